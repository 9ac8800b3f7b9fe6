"""Demo scenes, built into the current Blender file.

``cornell`` is the Cornell box (Goral et al. 1984): open to the front (-y), 2 m along each edge.
It is one mesh, so that one image holds all of it. The blocks have no bottom faces: those would
lie in the floor's plane and hide it by chance.
"""

from __future__ import annotations

import numpy as np

from ..solver.expected import Refused

WHITE = (0.73, 0.73, 0.73)  # color [linear] of ceiling, floor and back
RED = (0.61, 0.055, 0.06)  # color [linear] of the left wall
GREEN = (0.117, 0.435, 0.115)  # color [linear] of the right wall
LAMP_COLOR = (1.0, 0.86, 0.62)  # color [linear] of the lamp
LAMP_STRENGTH = 15.0  # radiance [W/m²/sr]
LAMP_GAP = 0.002  # distance [m] of the lamp below the ceiling
# Corners [half edges] of a cube that stands on the floor.
CUBE = ((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0),
        (-1, -1, 2), (1, -1, 2), (1, 1, 2), (-1, 1, 2))  # fmt: skip


def build_demo(name: str):
    """Build the demo scene called ``name`` in the current scene; return its mesh object.

    Raises Refused for an unknown name.
    """
    if name not in DEMOS:
        raise Refused(f"there is no demo {name!r}; choose one of {', '.join(DEMOS)}")
    return DEMOS[name]()


def build_cornell():
    """The Cornell box as one mesh object, with a camera in front of it."""
    import bpy

    faces = _walls() + _block((0.35, -0.36), 0.30, 0.60, -17.0)
    faces += _block((-0.33, 0.33), 0.30, 1.20, 18.0) + [_lamp()]
    points = np.concatenate([corners for corners, _ in faces])
    mesh = bpy.data.meshes.new("Cornell")
    mesh.from_pydata(points.tolist(), [], np.arange(len(points)).reshape(-1, 4).tolist())
    for material in (
        _diffuse("White", WHITE),
        _diffuse("Red", RED),
        _diffuse("Green", GREEN),
        _emitter("Lamp", LAMP_COLOR, LAMP_STRENGTH),
    ):
        mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", [slot for _, slot in faces])
    _merge_corners(mesh)
    mesh.validate()
    box = bpy.data.objects.new("Cornell", mesh)
    bpy.context.scene.collection.objects.link(box)
    _add_camera()
    return box


DEMOS = {"cornell": build_cornell}


def _quads(corners: np.ndarray, indices, slots) -> list[tuple[np.ndarray, int]]:
    return [(corners[list(quad)], slot) for quad, slot in zip(indices, slots)]


def _walls() -> list[tuple[np.ndarray, int]]:
    """Floor, ceiling, back, left (red) and right (green), all facing inwards."""
    quads = ((0, 1, 2, 3), (4, 7, 6, 5), (3, 2, 6, 7), (0, 3, 7, 4), (1, 5, 6, 2))
    return _quads(np.array(CUBE, float), quads, (0, 0, 0, 1, 2))


def _block(center, half: float, height: float, degrees: float) -> list[tuple[np.ndarray, int]]:
    """A white block standing on the floor, turned about z; no bottom; faces outwards."""
    angle = np.radians(degrees)
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    corners = np.array(CUBE, float)
    corners[:, :2] = half * corners[:, :2] @ rotation.T + center
    corners[:, 2] *= height / 2
    quads = ((4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
    return _quads(corners, quads, (0,) * 5)


def _lamp() -> tuple[np.ndarray, int]:
    """The emissive quad below the ceiling, facing down."""
    x, y, z = 0.235, 0.19, 2.0 - LAMP_GAP
    return np.array([(-x, -y, z), (-x, y, z), (x, y, z), (x, -y, z)]), 3


def _merge_corners(mesh) -> None:
    """Weld the quads' common corners, so that walls and blocks are connected."""
    import bmesh

    work = bmesh.new()
    try:
        work.from_mesh(mesh)
        bmesh.ops.remove_doubles(work, verts=work.verts, dist=LAMP_GAP / 4)
        work.to_mesh(mesh)
    finally:
        work.free()


def _material(name: str, shader: str, color, **inputs):
    """A material whose only surface node is ``shader`` with the given color and inputs."""
    import bpy

    material = bpy.data.materials.new(name)
    if not material.node_tree:
        material.use_nodes = True
    material.diffuse_color = (*color, 1.0)
    nodes = material.node_tree.nodes
    nodes.clear()
    node, output = nodes.new(shader), nodes.new("ShaderNodeOutputMaterial")
    node.inputs["Color"].default_value = (*color, 1.0)
    for socket, value in inputs.items():
        node.inputs[socket].default_value = value
    material.node_tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material


def _diffuse(name: str, color):
    return _material(name, "ShaderNodeBsdfDiffuse", color)


def _emitter(name: str, color, strength: float):
    return _material(name, "ShaderNodeEmission", color, Strength=strength)


def _add_camera() -> None:
    """A camera on the axis of the box whose frame just holds the open side."""
    import bpy

    data = bpy.data.cameras.new("Camera")
    data.angle = 2 * np.arctan(1.02 / 2.8)
    camera = bpy.data.objects.new("Camera", data)
    camera.location = (0.0, -3.8, 1.0)
    camera.rotation_euler = (np.pi / 2, 0.0, 0.0)
    scene = bpy.context.scene
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x = scene.render.resolution_y = 512
