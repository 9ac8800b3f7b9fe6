"""UV maps made for objects that lack one; everything else of the user's is left alone. bpy.

The charts come from Blender's own operators, or from another UV map of the object.
"""

from __future__ import annotations

import math
from contextlib import redirect_stdout
from io import StringIO

import numpy as np

from ..solver.expected import Refused
from ..steps import finish, scaled
from .bake_notes import read_made
from .layers import bulk, check_editable
from .overlaps import overlap_steps
from .pack import Chart, pack
from .seams import cut_sharp_edges
from .uv_edit import Shape, edit_uvs, shape_of
from .uv_maps import FALLBACK, HeldMap, find_uv_map, free_name, give_maps
from .windows import own_size

# Angle [rad] between neighbors: those that differ by less may share a chart.
ANGLE = math.radians(66)
HOW = "unwrap"  # name [fact of a map] of the way in which its charts were made
MOST_MAPS = 8  # number [UV maps] that Blender renders from
ATTEMPTS = 4  # number [attempts] at a layout without overlaps
CHECKED = 256  # edge [texels] of the image in which overlaps are looked for
# Gap [texels] between charts: at least LEAST_GAP, and resolution / GAP_SHARE.
LEAST_GAP, GAP_SHARE = 3, 128


def ensure_uv_map(
    objects, name: str = "Radiosity", resolution: int = 1024, margin: int = 8, how: str = "smart"
) -> list[tuple[str, str]]:
    """Make the UV map on the meshes of ``objects`` that lack it.

    Returns (object name, map name) of each map made, one per mesh: objects that share a mesh share
    the map, laid out for the first one's scale. The active map and the one that renders stay.
    Charts are at least three texels apart, more at larger resolutions if the margin asks for it.
    Raises Refused, with nothing made, for a linked mesh and for one with 8 UV maps.
    """
    names = [item.name for item in objects]
    held = finish(unwrap_steps(names, name, (resolution, resolution), margin, how))
    give_maps(held)
    return [each.pair for each in held]


def unwrap_steps(objects, name: str, size: tuple[int, int], margin: int, how: str = "smart"):
    """The maps that ``ensure_uv_map`` makes for objects of these names and images of this size,
    held outside of the file: steps that return a list of HeldMap."""
    import bpy

    lacking = {}
    for each in objects:
        mesh = bpy.data.objects[each].data
        if find_uv_map(mesh, name) is None:
            lacking.setdefault(mesh.name_full, each)
    for each in lacking.values():
        check_room(bpy.data.objects[each], name)
    held = []
    for index, each in enumerate(lacking.values()):
        item = bpy.data.objects.get(each)
        if item is None or item.type != "MESH":
            continue  # it was deleted between two steps
        existing = existing_uvs(item) if how == "existing" else None
        if item.data.is_editmode:
            item.update_from_editmode()
        identity, called = item.session_uid, free_name(item.data, name)
        shape, (width, height) = shape_of(item), own_size(item, size)
        gap = max(LEAST_GAP, min(2 * margin, min(width, height) // GAP_SHARE))
        uv = yield from chart_steps(shape, how, existing, gap / height, index / len(lacking))
        if how != "smart" or width != height:
            uv = pack([Chart(shape, uv)], (width, height), gap).uvs[0]
        held.append(HeldMap(identity, each, called, uv, {HOW: how}))
        yield (index + 1) / len(lacking)
    return held


def kept_maps(objects, name: str, how: str) -> list[str]:
    """Those of the objects of these names that have the UV map, made in another way than ``how`` would;
    one of the user's own passes for "smart", so that nobody is warned who did not ask."""
    import bpy

    kept = []
    for each in objects:
        item = bpy.data.objects.get(each)
        found = find_uv_map(item.data, name) if item is not None and item.type == "MESH" else None
        if found and read_made(item.data).get(found, {}).get(HOW, "smart") != how:
            kept.append(each)
    return kept


def existing_uvs(item) -> np.ndarray:
    """(n_loops, 2) float32 of the UV map by which the object's textures lie. Raises Refused where
    there is none, or where Edit Mode holds it."""
    if item.data.is_editmode:
        raise Refused(f"{item.name!r} is in Edit Mode; leave it, so that its UV map can be read")
    layers = item.data.uv_layers
    if not len(layers):
        raise Refused(
            f"{item.name!r} has no UV map whose charts could be used; unwrap it, or choose smart or "
            "lightmap for --unwrap"
        )
    layer = next((each for each in layers if each.active_render), layers[0])
    return bulk(layer.data, "uv", np.float32, 2)


def check_room(item, name: str) -> None:
    """Raise Refused where the object's mesh cannot get the UV map ``name``."""
    check_editable(item.name, item.data)
    if len(item.data.uv_layers) >= MOST_MAPS:
        raise Refused(
            f"{item.name!r} has {MOST_MAPS} UV maps, the most that Blender renders from; remove "
            f"one, or name the one to bake to with --uv-map instead of {name!r}"
        )
    if name in item.data.attributes and FALLBACK.format(name) in item.data.attributes:
        raise Refused(f"{item.name!r} has attributes {name!r} that are no UV map; rename them")


def chart_steps(shape: Shape, how: str, existing: np.ndarray | None, gap: float, done: float):
    """(n_loops, 2) float32 UVs of one mesh: steps that yield ``done``.

    ``how``: "smart" charts are ``gap`` of the unit square apart; "lightmap" makes a chart of each
    pair of faces; "existing" takes the UVs ``existing`` (n_loops, 2).
    """
    if not len(shape.start):
        return np.zeros((0, 2), np.float32)
    if how == "existing":
        return existing
    if how == "lightmap":
        yield done
        return edit_uvs(shape, None, _lightmap)[0]
    return (yield from _smart_steps(shape, gap, done))


def _smart_steps(shape: Shape, gap: float, done: float):
    """Where the projection folds over itself, the faces on top are cut loose and it is done again."""
    points, corner = cut_sharp_edges(shape.points, shape.corner, shape.start, ANGLE)
    for _ in range(ATTEMPTS):
        cut = Shape(points, corner, shape.start)
        uv, triangles, face = edit_uvs(cut, None, lambda: _smart(gap))
        yield done
        layer = yield from scaled(done, done, overlap_steps(
            uv[triangles].astype(float), face, corner[triangles], len(shape.start), CHECKED
        ))  # fmt: skip
        if not layer.any():
            break
        loose, corner = np.unique(
            corner + np.repeat(layer, cut.sizes) * len(points), return_inverse=True
        )
        points = points[loose % len(points)]
    return np.clip(uv, 0.0, 1.0)


def _smart(gap: float) -> None:
    import bpy

    bpy.ops.uv.smart_project(angle_limit=ANGLE, island_margin=gap / 2, margin_method="FRACTION")


def _lightmap() -> None:
    import bpy

    with redirect_stdout(StringIO()):  # Blender reports its work there
        bpy.ops.uv.lightmap_pack(PREF_CONTEXT="ALL_FACES", PREF_PACK_IN_ONE=True)
