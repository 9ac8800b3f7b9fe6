"""Pipeline: the steps of an export in order.

Between two steps names and arrays are held, nothing of Blender's: see ``steps``.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from ..bake.exported_object import ExportedObject
from ..bake.layers import within_range
from ..bake.windows import TexelRect, full_rect, sheet_of, texels_covered, window
from ..settings import Target
from ..solver.expected import Refused
from ..solver.passes import Pass
from ..solver.scene import Scene
from .assemble import (
    Assembly,
    Placed,
    assemble,
    corner_loops,
    material_indices,
    scatter_colors,
    scatter_lookups,  # fmt: skip
    scatter_uvs,
)
from .colors import in_border
from .corner_weights import one_hot, traced
from .evaluated import PICTURES, evaluate_steps
from .exported import Exported
from .illumination import Illumination, find_illumination
from .light_objects import Light, read_lights, with_node_colors
from .material_slots import gloss_remarks, read_materials, scene_materials
from .mesh_arrays import read_loop_vertices
from .mesh_trace import Trace, add_copies, changes_faces, face_modifiers, read_trace
from .parts import Part, read_parts, world_vertices
from .remarks import bent_remarks, library_remarks
from .render_depsgraph import with_render_depsgraph
from .shading_normals import (
    bent_materials,
    corner_normals,
    light_fades,
    texel_normal_steps,  # fmt: skip
)
from .smooth_groups import smooth_groups
from .targets import NO_FACES, NO_NUMBERS, UNTRACED, choose_objects, sort_out, uv_map_name, why_none
from .traceless import traceless

EDITED = "was deleted or edited while the scene was read"


@dataclass(frozen=True)
class Receiver:
    """An object that gets colors, known by what a new name or an undo leaves as it is."""

    name: str
    identity: int  # session id
    n_loops: int
    uv_map: str
    modifiers: tuple[str, ...]
    trace: Trace | None
    sheet: str | None = None  # the atlas' image that its texels are in; None: its own
    size: tuple[int, int] = (0, 0)  # width and height of that image


@dataclass(frozen=True)
class Evaluated:
    """What one evaluation for rendering gave; receivers' own parts come first, in order."""

    parts: list[Part]
    receivers: list[Receiver]
    lights: list[Light]
    skipped: list[tuple[str, str]]
    warnings: list[str]


def steps(scene, view_layer, settings, progress):
    """The steps of ``export_scene``, which return what it returns. The first is the longest: one
    evaluation of the scene, which Blender does in one piece. ``progress`` may raise during it."""
    name = scene.name
    read = _evaluate(scene, view_layer, settings, progress)
    yield 0.3
    warnings = read.warnings
    geometry = assemble(read.parts, warnings)
    yield 0.5
    with traceless():
        palette = read_materials(read.parts, settings.glossy_bounces)
        frame = _find_scene(name).frame_current
        lights = with_node_colors(read.lights, frame, warnings)
    yield 0.5
    texel_normals, windows = {}, [(None, None)] * len(read.receivers)
    if settings.target == Target.IMAGE:
        windows = [_window(*pair) for pair in zip(read.receivers, geometry.placed)]
    shown = {}
    if {Pass.COLOR, Pass.EMIT} & set(settings.passes):
        shown = {number: texels_covered(*found) for number, found in enumerate(windows) if found[0] is not None}
    for fraction in evaluate_steps(
        read.parts, palette, lambda: _find_scene(name), settings.glossy_bounces, shown, settings.target_error
    ):
        yield 0.5 + 0.2 * fraction
    if settings.target == Target.IMAGE and settings.shading_normals:
        rects = [(placed, *found) for placed, found in zip(geometry.placed, windows)]
        for fraction in texel_normal_steps(rects, lambda: _find_scene(name), texel_normals):
            yield 0.7 + 0.1 * fraction
    elif settings.shading_normals:
        warnings += bent_remarks(bent_materials(read.parts[: len(read.receivers)]))
    illumination = find_illumination(_find_scene(name), read.parts, palette, lights, warnings)
    yield 0.8
    objects, skipped = [], list(read.skipped)
    for number, (receiver, placed) in enumerate(zip(read.receivers, geometry.placed)):
        found = _object(receiver, placed, settings, texel_normals.get(number), *windows[number])
        if isinstance(found, str):
            skipped.append((receiver.name, found))
        else:
            objects.append(found)
        yield 0.8 + 0.2 * len(objects) / len(read.receivers)
    warnings += palette.warnings + gloss_remarks(palette, settings)
    return _exported(geometry, palette, illumination, objects, skipped, warnings)


def _find_scene(name: str):
    import bpy

    scene = bpy.data.scenes.get(name)
    if scene is None:
        raise Refused(f"scene {name!r} is gone; bake again")
    return scene


def _flush_edit_mode(view_layer) -> None:
    """Bring the meshes of objects in edit mode up to date, as a render would."""
    for item in view_layer.objects:
        if item.mode == "EDIT":
            item.update_from_editmode()


def _evaluate(scene, view_layer, settings, progress) -> Evaluated:
    """All that is read from the scene as the render sees it, in one go."""
    _ = view_layer.objects.active  # asking brings the layer's list of objects up to date
    chosen = choose_objects(view_layer, settings.objects)
    _flush_edit_mode(view_layer)
    with traceless():
        parts, seen, lights, traces, warnings = _render(
            scene, view_layer, chosen, settings, progress
        )
        items, skipped = sort_out(chosen, parts, seen, settings)
        receivers = [_receiver(item, settings, traces.get(item.name)) for item in items]
        warnings += library_remarks()
    return Evaluated(_receivers_first(parts, receivers), receivers, lights, skipped, warnings)


def _receiver(item, settings, trace: Trace | None) -> Receiver:
    uv_map = uv_map_name(item, settings)
    return Receiver(
        item.name, item.session_uid, len(item.data.loops), uv_map, face_modifiers(item), trace,
        *sheet_of(item, uv_map, settings),
    )  # fmt: skip


def _render(scene, view_layer, chosen, settings, progress):
    """Parts, names of rendered objects, lights, {object name: Trace} and warnings."""
    copies: dict[str, str] = {}

    def prepare(temporary):
        if settings.target == Target.VERTEX:
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
    rank = {receiver.name: index for index, receiver in enumerate(receivers)}
    keyed = [(rank.get(p.name, len(rank)) if not p.instance else len(rank), p) for p in parts]
    return [part for _, part in sorted(keyed, key=lambda pair: pair[0])]


def _window(receiver: Receiver, placed: Placed) -> tuple[TexelRect, np.ndarray]:
    """Where a receiver's texels lie, and its triangles' UVs (n, 3, 2) float64 there."""
    uv = placed.part.mesh.uvs[receiver.uv_map][corner_loops(placed)].astype(np.float64)
    if receiver.sheet is None or not len(uv):
        return full_rect(receiver.size), uv
    return window(receiver.sheet, receiver.size, uv)


def _object(
    receiver: Receiver, placed: Placed, settings, texels, rect: TexelRect | None, uv
) -> ExportedObject | str:
    """What the bake needs of one receiver, or why it is left out."""
    start, stop = placed.start, placed.stop
    if stop == start:
        return NO_FACES if within_range(world_vertices(placed.part)).all() else NO_NUMBERS
    weights = vertex = groups = None
    if settings.target == Target.VERTEX:
        mesh = _find_mesh(receiver)
        if mesh is None:
            return EDITED
        weights = _corner_map(mesh, placed, receiver.trace)
        if weights is None:
            return UNTRACED
        vertex = read_loop_vertices(mesh)
        groups = smooth_groups(mesh)
    return ExportedObject(
        receiver.name, start, stop, uv, weights, vertex, groups,
        receiver.identity, receiver.n_loops, receiver.modifiers,
        _normals(placed, settings, texels), texels,
        texels is not None and light_fades(placed.part), rect,
    )  # fmt: skip


def _normals(placed: Placed, settings, texels) -> np.ndarray | None:
    """How the corners of a part's triangles are shaded; None: as they lie."""
    return corner_normals(placed, texels is not None) if settings.shading_normals else None


def _find_mesh(receiver: Receiver):
    """The user's mesh of today; None when it is gone or has other corners now."""
    import bpy

    items = (item for item in bpy.data.objects if item.session_uid == receiver.identity)
    item = next(items, None)
    if item is None or item.type != "MESH" or len(item.data.loops) != receiver.n_loops:
        return None
    return item.data


def _corner_map(mesh, placed: Placed, trace: Trace | None):
    """Weights of the user's loops at the triangle corners; None when faces cannot be traced."""
    evaluated = placed.part.mesh
    if trace is not None:
        if trace.n_loops != len(evaluated.loop_vertex):
            return None
        return traced(corner_loops(placed), evaluated.polygon[placed.kept], trace, mesh)
    if len(evaluated.loop_vertex) != len(mesh.loops):
        return None
    return one_hot(corner_loops(placed), len(mesh.loops))


def _uvs(geometry: Assembly, name: str, lookups) -> np.ndarray:
    """(n_triangles, 3, 2) float32 of a UV map, or the places in pictures of evaluated materials."""
    return scatter_lookups(geometry, lookups) if name == PICTURES else scatter_uvs(geometry, name)


def _exported(
    geometry: Assembly, palette, illumination: Illumination, objects, skipped, warnings
) -> Exported:
    """All that was read, put together. Raises Refused where no object is left to bake."""
    if not objects:
        raise Refused("there is no mesh to bake; " + why_none(skipped))
    parts = [placed.part for placed in geometry.placed]
    maps = functools.cache(lambda name: _uvs(geometry, name, palette.lookups))
    uvs = functools.cache(lambda name, border: in_border(maps(name), border))
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
        lamps=tuple(light.lamp for light in illumination.lights),
        sky=illumination.sky,
        casts_shadow=np.array([part.casts_shadow for part in parts]),
        visible=np.array([part.visible for part in parts]),
        lamp_objects=illumination.lamp_objects,
        lamp_blockers=illumination.lamp_blockers,
        emission_objects=illumination.emission_objects,
        emission_blockers=illumination.emission_blockers,
        warnings=tuple(warnings),
    )
    return Exported(scene, tuple(objects), tuple(skipped), tuple(dict.fromkeys(warnings)))
