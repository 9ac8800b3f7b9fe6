"""Pipeline: the steps of an export in order. Depends on bpy and the other files of this room."""

from __future__ import annotations

import numpy as np

from ..solver.scene import Scene
from .assemble import (Geometry, assemble, corner_loops, material_indices, scatter_colors,
                       scatter_uvs)  # fmt: skip
from .corners import one_hot
from .evaluate import with_render_depsgraph
from .exported import Exported, ExportedObject
from .images import working_space_is_rec709
from .lights import Light, read_lights
from .materials import read_materials, scene_materials
from .meshes import bulk
from .parts import read_parts
from .smooth import smooth_groups
from .sockets import Reader
from .targets import NO_FACES, choose_objects, sort_out, uv_map_name
from .traceless import traceless
from .world import read_world


def run(scene, view_layer, settings, progress) -> Exported:
    """See ``export_scene``."""
    _ = view_layer.objects.active  # asking brings the layer's list of objects up to date
    chosen = choose_objects(view_layer, settings.objects)
    _flush_edit_mode(view_layer)
    with traceless():
        parts, lights, warnings = with_render_depsgraph(scene, view_layer, _read)
        progress(0.3)
        receivers, skipped = sort_out(chosen, parts, settings, bool(settings.objects))
        parts = _receivers_first(parts, receivers)
        geometry = assemble(parts, warnings)
        progress(0.5)
        palette = read_materials(parts)
        progress(0.6)
        sky, suns = read_world(scene, Reader(working_space_is_rec709()), warnings)
        lights += [Light(sun) for sun in suns]
        progress(0.8)
        objects = _objects(receivers, geometry, settings, skipped)
    warnings += palette.warnings
    return _exported(geometry, palette, lights, sky, objects, skipped, warnings)


def _flush_edit_mode(view_layer) -> None:
    """Bring the meshes of objects in edit mode up to date, as a render would."""
    for thing in view_layer.objects:
        if thing.mode == "EDIT":
            thing.update_from_editmode()


def _read(depsgraph):
    """Parts, lights and warnings from the evaluated scene."""
    parts, warnings = read_parts(depsgraph)
    lights = read_lights(depsgraph, warnings)
    return parts, lights, warnings


def _receivers_first(parts, receivers):
    """Receivers in their order, then all other parts in Blender's."""
    rank = {thing.name: index for index, thing in enumerate(receivers)}
    keyed = [(rank.get(p.name, len(rank)) if not p.instance else len(rank), p) for p in parts]
    return [part for _, part in sorted(keyed, key=lambda pair: pair[0])]


def _objects(receivers, geometry: Geometry, settings, skipped) -> list[ExportedObject]:
    result = []
    for thing, placed in zip(receivers, geometry.placed):
        if placed.stop == placed.start:
            skipped.append((thing.name, NO_FACES))
            continue
        loops = corner_loops(placed)
        mesh = placed.part.mesh
        if settings.target == "image":
            uv = mesh.uvs[uv_map_name(thing, settings)][loops].astype(np.float64)
            result.append(ExportedObject(thing.name, placed.start, placed.stop, uv, None, None, None))
            continue
        result.append(
            ExportedObject(
                thing.name, placed.start, placed.stop, None,
                one_hot(loops, len(thing.data.loops)),
                bulk(thing.data.loops, "vertex_index", np.int32),
                smooth_groups(thing.data),
            )
        )  # fmt: skip
    return result


def _exported(geometry: Geometry, palette, lights, sky, objects, skipped, warnings) -> Exported:
    if not objects:
        reasons = "; ".join(f"{name} {reason}" for name, reason in skipped)
        raise ValueError(f"no mesh to bake{': ' + reasons if reasons else '; add a mesh with faces'}")
    parts = [placed.part for placed in geometry.placed]
    scene = Scene(
        vertices=geometry.vertices,
        triangles=geometry.triangles,
        material=material_indices(geometry, palette, {}),
        object=geometry.object,
        materials=scene_materials(
            palette,
            lambda name: scatter_uvs(geometry, name),
            lambda name: scatter_colors(geometry, name),
        ),
        objects=tuple(part.name for part in parts),
        lamps=tuple(light.lamp for light in lights),
        sky=sky,
        casts_shadow=np.array([part.casts_shadow for part in parts]),
        visible=np.array([part.visible for part in parts]),
        warnings=tuple(warnings),
    )
    return Exported(scene, tuple(objects), tuple(skipped), tuple(dict.fromkeys(warnings)))
