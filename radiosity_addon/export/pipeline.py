"""Pipeline: the steps of an export in order. Depends on bpy and the other files of this room."""

from __future__ import annotations

import functools

import numpy as np

from ..solver.scene import Scene
from .assemble import (Geometry, assemble, corner_loops, material_indices,
                       scatter_atlas, scatter_colors, scatter_uvs)  # fmt: skip
from .corners import one_hot, traced
from .evaluated import ATLAS, evaluate_difficult
from .evaluate import with_render_depsgraph
from .exported import Exported, ExportedObject
from .images import working_space_is_rec709
from .lights import Light, lit_objects, read_lights, with_node_colors
from .materials import read_materials, scene_materials
from .meshes import bulk
from .parts import read_parts
from .smooth import smooth_groups
from .sockets import Reader
from .targets import NO_FACES, UNTRACED, choose_objects, sort_out, uv_map_name
from .traceless import traceless
from .tracing import add_copies, changes_faces, read_trace
from .world import read_world


def run(scene, view_layer, settings, progress) -> Exported:
    """See ``export_scene``."""
    _ = view_layer.objects.active  # asking brings the layer's list of objects up to date
    chosen = choose_objects(view_layer, settings.objects)
    _flush_edit_mode(view_layer)
    with traceless():
        parts, seen, lights, traces, warnings = _evaluate(
            scene, view_layer, chosen, settings, progress
        )
        progress(0.3)
        receivers, skipped = sort_out(chosen, parts, seen, settings)
        parts = _receivers_first(parts, receivers)
        geometry = assemble(parts, warnings)
        progress(0.5)
        palette = read_materials(parts)
        evaluate_difficult(parts, palette, scene, progress)
        progress(0.7)
        sky, suns = read_world(scene, Reader(working_space_is_rec709()), warnings)
        lights = with_node_colors(lights, warnings) + [Light(sun) for sun in suns]
        progress(0.8)
        objects = _objects(receivers, geometry, traces, settings, skipped)
    warnings += palette.warnings
    return _exported(geometry, palette, lights, sky, objects, skipped, warnings)


def _flush_edit_mode(view_layer) -> None:
    """Bring the meshes of objects in edit mode up to date, as a render would."""
    for thing in view_layer.objects:
        if thing.mode == "EDIT":
            thing.update_from_editmode()


def _evaluate(scene, view_layer, chosen, settings, progress):
    """Parts, names of rendered objects, lights, {object name: Trace} and warnings."""
    copies: dict[str, str] = {}

    def prepare(temporary):
        if settings.target == "vertex":
            changed = [t for t in chosen if t.type == "MESH" and changes_faces(t)]
            copies.update(add_copies(temporary, changed))

    def read(depsgraph):
        parts, seen, warnings = read_parts(depsgraph, progress, copies)
        lights = read_lights(depsgraph, warnings)
        traces = {
            copies[entry.object.name]: read_trace(entry.object.data)
            for entry in depsgraph.object_instances
            if not entry.is_instance and entry.object.name in copies
        }
        return parts, seen, lights, traces, warnings

    return with_render_depsgraph(scene, view_layer, read, prepare)


def _receivers_first(parts, receivers):
    """Receivers in their order, then all other parts in Blender's."""
    rank = {thing.name: index for index, thing in enumerate(receivers)}
    keyed = [(rank.get(p.name, len(rank)) if not p.instance else len(rank), p) for p in parts]
    return [part for _, part in sorted(keyed, key=lambda pair: pair[0])]


def _objects(receivers, geometry: Geometry, traces, settings, skipped) -> list[ExportedObject]:
    """What the bake needs of each receiver; those without triangles or corner map are skipped."""
    result = []
    for thing, placed in zip(receivers, geometry.placed):
        start, stop = placed.start, placed.stop
        if stop == start:
            skipped.append((thing.name, NO_FACES))
        elif settings.target == "image":
            uv = placed.part.mesh.uvs[uv_map_name(thing, settings)][corner_loops(placed)]
            uv = uv.astype(np.float64)
            result.append(ExportedObject(thing.name, start, stop, uv, None, None, None))
        else:
            weights = _corner_map(thing, placed, traces.get(thing.name))
            if weights is None:
                skipped.append((thing.name, UNTRACED))
                continue
            vertex = bulk(thing.data.loops, "vertex_index", np.int32)
            groups = smooth_groups(thing.data)
            result.append(ExportedObject(thing.name, start, stop, None, weights, vertex, groups))
    return result


def _corner_map(thing, placed, trace):
    """Weights of the user's loops at the triangle corners; None when faces cannot be traced."""
    mesh = placed.part.mesh
    if trace is not None:
        if trace.n_loops != len(mesh.loop_vertex):
            return None
        return traced(corner_loops(placed), mesh.polygon[placed.kept], trace, thing.data)
    if len(mesh.loop_vertex) != len(thing.data.loops):
        return None
    return one_hot(corner_loops(placed), len(thing.data.loops))


def _uvs(geometry: Geometry, name: str, atlases) -> np.ndarray:
    """(n_triangles, 3, 2) float32 of a UV map, or of the atlases of evaluated materials."""
    return scatter_atlas(geometry, atlases) if name == ATLAS else scatter_uvs(geometry, name)


def _exported(geometry: Geometry, palette, lights, sky, objects, skipped, warnings) -> Exported:
    if not objects:
        reasons = "; ".join(f"{name} {reason}" for name, reason in skipped)
        raise ValueError(f"no mesh to bake: {reasons or 'add one that renders and has faces'}")
    parts = [placed.part for placed in geometry.placed]
    uvs = functools.cache(lambda name: _uvs(geometry, name, palette.atlases))
    scene = Scene(
        vertices=geometry.vertices,
        triangles=geometry.triangles,
        material=material_indices(geometry, palette),
        object=geometry.object,
        materials=scene_materials(
            palette,
            uvs,
            lambda name: scatter_colors(geometry, name),
        ),
        objects=tuple(part.name for part in parts),
        lamps=tuple(light.lamp for light in lights),
        sky=sky,
        casts_shadow=np.array([part.casts_shadow for part in parts]),
        visible=np.array([part.visible for part in parts]),
        lamp_objects=lit_objects(lights, parts),
        warnings=tuple(warnings),
    )
    return Exported(scene, tuple(objects), tuple(skipped), tuple(dict.fromkeys(warnings)))
