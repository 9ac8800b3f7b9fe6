"""Lamp shape: how a lamp's light varies with direction, by its node tree (IES files and others).

Cycles itself is asked: it renders the inside of a white sphere around a copy of the lamp, once with its
tree and once with a plain one. The quotient of both pictures is what the tree makes of the lamp, for
every direction and whatever nodes it has. Call inside ``traceless()``.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .lamp_detail import Box, refined
from .panorama import as_diffuse_ray, panorama, set_up_cycles
from .photometry import NOTABLE, narrow_share, read_photometry
from .remarks import nodes_of
from .traceless import temporary_camera

# Widths [pixels] of the first picture: half a degree each, finer where an IES text has narrow beams.
WIDTH, WIDTHS = 720, (720, 1440, 2880)
GLANCE = 16  # width [pixels] of a picture that only shows whether anything varies
# Numbers [rings, slices] of the sphere: its facets cancel out in the quotient.
RINGS, SLICES = 32, 64
ASKEW = (0.3, 0.5, 0.7)  # how it is turned [rad]: no pixel's middle lies on an edge, where rays slip through
HUE = 1e-3  # difference [of the brightest direction]: channels that differ by less are of one hue
ALIKE = 1e-4  # difference [of the brightest direction] that float32 and facets leave
# Factor [of a lamp's power] that Cycles takes for an IES text that it cannot read.
UNREADABLE = 100.0
IES, FALLOFF, PATH = "ShaderNodeTexIES", "ShaderNodeLightFalloff", "ShaderNodeLightPath"


class LampScene:
    """A temporary scene in which lamps' node trees are rendered one after the other."""

    def __init__(self, frame: int):
        import bpy

        scene = bpy.data.scenes.new("Radiosity temporary")
        scene.frame_current = frame
        scene.world = bpy.data.worlds.new("Radiosity temporary")
        scene.world.color = (0.0, 0.0, 0.0)
        scene.camera = temporary_camera(scene)
        set_up_cycles(scene)
        scene.cycles.max_bounces = 0
        scene.cycles.pixel_filter_type, scene.cycles.filter_width = "GAUSSIAN", 0.01  # middles
        self.scene, self.pictures = scene, {}
        self.sphere = bpy.data.objects.new("Radiosity temporary", _sphere())
        self.lamp = bpy.data.objects.new("Radiosity temporary", plain_lamp())
        self.sphere.rotation_euler = ASKEW
        for item in (self.sphere, self.lamp):
            scene.collection.objects.link(item)

    def factor(
        self, data, matrix: np.ndarray, width: int = WIDTH, box: Box | None = None
    ) -> np.ndarray:
        """(width / 2, width, 3) what the node tree of light ``data``, placed by ``matrix`` (4, 4),
        multiplies its intensity with, in directions laid out as ``solver.scene.Sky``; or a ``box`` of
        it."""
        key = width, str(box)
        if key not in self.pictures:
            self.pictures[key] = self._render(plain_lamp(), np.eye(4), width, box)
        picture = self._render(_as_point(data), matrix, width, box)
        return np.maximum(np.nan_to_num(picture / self.pictures[key], posinf=0.0), 0.0)

    def fine_factor(self, data, matrix: np.ndarray) -> tuple[np.ndarray, float]:
        """``factor`` of ``matrix`` (4, 4), as fine as narrow beams need it, and the relative error that
        interpolation leaves, or beams that no picture meets."""
        width, missed = start_width(data.node_tree)
        coarse = self.factor(data, matrix, width)
        picture, error = refined(coarse, lambda width, box: self.factor(data, matrix, width, box))
        return picture, max(error, missed)

    def _render(self, data, matrix: np.ndarray, width: int, box: Box | None) -> np.ndarray:
        from mathutils import Matrix

        self.lamp.data = data
        self.lamp.matrix_world = Matrix(matrix.tolist())  # nested lists would be taken for columns
        for item in (self.sphere, self.scene.camera):
            item.location = matrix[:3, 3]
        return panorama(self.scene, width, 1, box).astype(np.float64)


def _sphere():
    """A mesh of radius 1, smooth, white where light comes from its middle."""
    import bpy

    polar = np.pi * np.arange(1, RINGS) / RINGS
    azimuth = 2 * np.pi * np.arange(SLICES) / SLICES
    ring = np.stack([np.outer(np.sin(polar), f(azimuth)) for f in (np.cos, np.sin)]
                    + [np.repeat(np.cos(polar)[:, None], SLICES, 1)], -1).reshape(-1, 3)  # fmt: skip
    points = [*ring.tolist(), (0, 0, 1), (0, 0, -1)]
    top, last, after = len(ring), (RINGS - 2) * SLICES, [*range(1, SLICES), 0]
    faces = [(r * SLICES + s, (r + 1) * SLICES + s, (r + 1) * SLICES + t, r * SLICES + t)
             for r in range(RINGS - 2) for s, t in enumerate(after)]  # fmt: skip
    faces += [(top, s, t) for s, t in enumerate(after)]
    faces += [(top + 1, last + t, last + s) for s, t in enumerate(after)]
    mesh = bpy.data.meshes.new("Radiosity temporary")
    mesh.from_pydata(points, [], faces)
    mesh.polygons.foreach_set("use_smooth", np.ones(len(faces), bool))
    return mesh


def plain_lamp():
    """A point lamp of intensity 1 that shines alike in all directions."""
    import bpy

    return _set_plain(bpy.data.lights.new("Radiosity temporary", "POINT"))


def _set_plain(data):
    plain = {"energy": 4.0 * np.pi, "shadow_soft_size": 0.0, "color": (1.0, 1.0, 1.0),
             "exposure": 0.0, "use_temperature": False, "normalize": True}  # fmt: skip
    for name, value in plain.items():
        if hasattr(data, name):
            setattr(data, name, value)
    return data


def _as_point(data):
    """A point lamp of intensity 1 with a copy of the node tree of ``data``."""
    import bpy

    copy = data.copy()
    copy.type = "POINT"
    copy = _set_plain(bpy.data.lights[copy.name])  # looked up anew: of its new type
    as_diffuse_ray(copy.node_tree)
    return copy


def split(factor: np.ndarray) -> list[tuple[np.ndarray, np.ndarray | None]]:
    """(color (3,), distribution) pairs whose products add up to a ``factor`` (h, w, 3): one where
    it is of one hue, else one a channel. Distributions (h, w) float32 have the maximum 1; None:
    alike in all directions."""
    peak = factor.max(axis=(0, 1))
    lit = np.flatnonzero(peak > 0)
    if len(lit) == 0:
        return []
    first = factor[..., lit[0]] / peak[lit[0]]
    if all(np.abs(factor[..., c] / peak[c] - first).max() < HUE for c in lit[1:]):
        return [(peak, None if first.min() > 1 - ALIKE else first.astype(np.float32))]
    return [part for c in lit for part in split(factor * (np.arange(3) == c))]


def tree_varies(tree) -> list[str]:
    """What of a lamp's node tree changes with distance, which the bake does not follow."""
    found = []
    for node in nodes_of(tree):
        used = {output.name for output in node.outputs if output.is_linked}
        smooth = FALLOFF == node.bl_idname and (
            node.inputs["Smooth"].is_linked or node.inputs["Smooth"].default_value > 0.0
        )
        if node.bl_idname == FALLOFF and used & {"Linear", "Constant"} or used and smooth:
            found.append(f"node {node.name}")
        elif node.bl_idname == PATH and "Ray Length" in used:
            found.append(f"the ray length of node {node.name}")
    return found


def start_width(tree) -> tuple[int, float]:
    """The width of a first picture that meets every beam of the tree's IES texts: a square grid meets
    what is as wide as its diagonal. And the share of a text's power in beams too narrow for any."""
    tables = [table for node in _ies_nodes(tree) if (table := read_photometry(_ies_text(node)))]
    missed = 0.0
    for width in WIDTHS:
        diagonal = np.sqrt(2.0) * 360.0 / width
        missed = max((narrow_share(table, diagonal) for table in tables), default=0.0)
        if missed < NOTABLE:
            break
    return width, missed


def _ies_nodes(tree) -> list:
    """The IES nodes that have a say."""
    nodes = (node for node in nodes_of(tree) if node.bl_idname == IES and not node.mute)
    return [node for node in nodes if node.outputs[0].is_linked]


def _ies_text(node) -> str:
    """What it holds; empty where there is none."""
    if node.mode == "INTERNAL":
        return node.ies.as_string() if node.ies else ""
    try:
        return Path(_ies_path(node)).read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


def _ies_path(node) -> str:
    import bpy

    return bpy.path.abspath(node.filepath, library=node.id_data.library)


def unreadable(lamp_scene: LampScene, tree) -> list[str]:
    """The IES files and texts of a lamp's node tree that Cycles cannot read."""
    found = []
    for node in _ies_nodes(tree):
        glance = lamp_scene.factor(_ies_alone(node), np.eye(4), GLANCE)
        if np.allclose(glance, UNREADABLE, rtol=1e-5):
            found.append(_ies_name(node))
    return list(dict.fromkeys(found))


def _ies_alone(node):
    """A lamp of nothing but the IES text of this node."""
    import bpy

    data = bpy.data.lights.new("Radiosity temporary", "POINT")
    if not data.node_tree:
        data.use_nodes = True
    tree = data.node_tree
    tree.nodes.clear()
    emission, output, copy = (
        tree.nodes.new(name) for name in ("ShaderNodeEmission", "ShaderNodeOutputLight", IES)
    )
    copy.mode, copy.ies = node.mode, node.ies
    copy.filepath = _ies_path(node)
    tree.links.new(copy.outputs[0], emission.inputs["Strength"])
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    return data


def _ies_name(node) -> str:
    if node.mode == "EXTERNAL":
        return f'IES file "{node.filepath}"' if node.filepath else "an IES node without a file"
    return f'IES text "{node.ies.name}"' if node.ies else "an IES node without a text"
