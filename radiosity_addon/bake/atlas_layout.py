"""Atlas layout: UV maps by which several objects share one image, or a few. bpy.

A layout is noted on the meshes. While it is as the bake asks for, it stays, so that one object can
be baked again alone; else all objects are laid out anew, together.
"""

from __future__ import annotations

import hashlib
import json

import numpy as np

from ..solver.expected import Refused
from .bake_notes import UV_MAP, read_made
from .pack import Chart, Packed, area_of, pack
from .unwrap import chart_steps, check_room, existing_uvs
from .uv_edit import shape_of
from .uv_maps import HeldMap, find_uv_map, free_name, held_now
from .windows import density_factor

LEAST_GAP = 3  # gap [texels] between charts: the least, whatever the margin
SMALLEST = 16  # edge [texels] of an image that is made smaller: the shorter one is no smaller
SMART_GAP = 1 / 256  # gap [unit square] between charts before they are packed


def atlas_steps(names: list[str], others: list[str], map_name: str, settings):
    """The UV maps by which the objects share ``settings.atlas``: steps that return a list of HeldMap, empty where the
    present layout is the one asked for. ``others`` are objects that may be in the atlas and are not baked now: their
    part of it must not move.

    Raises Refused where it would, and where the charts do not fit.
    """
    import bpy

    first = {bpy.data.objects[name].data.name_full: name for name in sorted(names, reverse=True)}
    names = sorted(first.values())
    lacking = _lacking(names, map_name, settings)
    if not lacking:
        return []
    bound = [name for name in others if _facts(bpy.data.objects[name], map_name).get("atlas")
             == settings.atlas and bpy.data.objects[name].data.name_full not in first]  # fmt: skip
    if bound:
        raise Refused(
            f"{lacking[0]!r} does not lie in the atlas {settings.atlas!r} as it is asked for, and "
            f"packing anew would move {bound[0]!r} ({len(bound)} in all), which is not baked: bake "
            "all of them together"
        )
    charts = []
    for index, name in enumerate(names):
        item = bpy.data.objects.get(name)
        if item is None:
            raise Refused(f"{name!r} was deleted while the atlas was laid out; bake again")
        if find_uv_map(item.data, map_name) is None:
            check_room(item, map_name)
        uv = existing_uvs(item) if settings.unwrap == "existing" else None
        if item.data.is_editmode:
            item.update_from_editmode()
        shape, factor = shape_of(item), density_factor(item)
        uv = yield from chart_steps(shape, settings.unwrap, uv, SMART_GAP, index / len(names))
        charts.append(Chart(shape, uv, factor))
        yield (index + 1) / len(names)
    packed = yield from _pack_steps(names, charts, settings)
    return _held(names, packed, map_name, settings)


def _lacking(names: list[str], map_name: str, settings) -> list[str]:
    """The objects whose map is not as asked for, or of another layout than the others'."""
    import bpy

    items = [bpy.data.objects[name] for name in names]
    facts = [_facts(item, map_name) for item in items]
    wanted = [_layout_key(item, settings) for item in items]
    lacking = [n for n, f, w in zip(names, facts, wanted)
               if f.get("atlas") != settings.atlas or f.get("layout") != w]  # fmt: skip
    several = len({f.get("packed") for f in facts}) > 1
    return lacking or (names if several else [])


def _facts(item, map_name: str) -> dict:
    """What was noted on the atlas map of an object; nothing without."""
    found = find_uv_map(item.data, map_name)
    return read_made(item.data).get(found, {}) if found else {}


def _layout_key(item, settings) -> str:
    """What decides where an object's charts lie, as text: another text asks for another layout."""
    return json.dumps([
        *settings.size, settings.atlas_images, settings.density, settings.margin, settings.unwrap,
        density_factor(item), len(item.data.loops),
    ])  # fmt: skip


def _pack_steps(names: list[str], charts: list[Chart], settings):
    """[(number of the image, its size, UVs)] for each object. Without a density all images are filled; with one the
    images are as few and as small as it allows."""
    areas = np.array([area_of(chart) for chart in charts])
    most = min(settings.atlas_images, len(charts))
    gap = max(LEAST_GAP, settings.margin)
    for images in range(1 if settings.density else most, most + 1):
        parts, tried = _share_out(areas, images), []
        for part in parts:
            tried.append(pack([charts[i] for i in part], settings.size, gap, settings.density))
            yield 1.0
        if all(_fits(each, settings.size) for each in tried):
            break
    else:
        raise Refused(_too_large(names, parts, tried, settings))
    found: list = [None] * len(names)
    for number, (part, packed) in enumerate(zip(parts, tried), 1):
        size, uvs = settings.size, packed.uvs
        if settings.density:
            size, uvs = _shrunk(packed, size)
        for index, uv in zip(part, uvs):
            found[index] = number, size, uv
    return found


def _share_out(areas: np.ndarray, images: int) -> list[list[int]]:
    """Which objects go into which image: the largest objects first, each into the image with the least area so far.
    """
    parts: list[list[int]] = [[] for _ in range(images)]
    filled = np.zeros(images)
    for index in np.argsort(-areas, kind="stable").tolist():
        least = int(filled.argmin())
        parts[least].append(index)
        filled[least] += areas[index]
    return [sorted(part) for part in parts if part]


def _fits(packed: Packed, size: tuple[int, int]) -> bool:
    """Whether all charts lie in the image, to a hundredth of a texel."""
    return all(used <= edge + 0.01 for used, edge in zip(packed.extent, size))


def _shrunk(packed: Packed, size: tuple[int, int]):
    """The smallest image, halved along both edges, that holds the charts; and the UVs in it."""
    uvs = packed.uvs
    while (
        all(2 * used <= edge for used, edge in zip(packed.extent, size))
        and not any(edge % 2 for edge in size) and min(size) >= 2 * SMALLEST
    ):
        size, uvs = (size[0] // 2, size[1] // 2), [uv * 2 for uv in uvs]
    return size, uvs


def _too_large(names, parts, tried: list[Packed], settings) -> str:
    """What to say where charts do not fit, and which settings would make them."""
    width, height = settings.size
    most = max(used / edge for each in tried for used, edge in zip(each.extent, settings.size))
    images = "one image" if len(parts) == 1 else f"{len(parts)} images"
    asked, lower = f"a margin of {settings.margin}", "lower --margin"
    if settings.density is not None:
        asked = f"{settings.density:g} texels per meter and {asked}"
        lower = f"lower --density (about {0.9 * settings.density / most:.2g} fit) or --margin"
    return (
        f"the charts of {len(names)} objects do not fit into {images} of {width} x {height} texels "
        f"at {asked}: they take {most:.3g} times an edge; {lower}, raise "
        "--resolution or --atlas-images, or bake fewer --objects"
    )


def _held(names: list[str], packed: list, map_name: str, settings) -> list[HeldMap]:
    """The maps, with what decided where their charts lie noted on them, and what they replace."""
    import bpy

    digest = hashlib.sha256()
    for number, size, uv in packed:
        digest.update(np.ascontiguousarray(uv).tobytes() + repr((number, size)).encode())
    held = []
    for name, (number, size, uv) in zip(names, packed):
        item = bpy.data.objects[name]
        called = find_uv_map(item.data, map_name) or free_name(item.data, map_name)
        facts = {
            "atlas": settings.atlas, "sheet": number, "size": list(size),
            "layout": _layout_key(item, settings), "packed": digest.hexdigest()[:16],
        }  # fmt: skip
        before = None
        if called in item.data.uv_layers:
            before = held_now(item, called)
        held.append(HeldMap(item.session_uid, name, called, uv, facts, before))
    return held


def check_own_maps(names: list[str], map_name: str) -> None:
    """Raise Refused for an object whose map of this name no bake made: it is not to be moved."""
    import bpy

    for name in names:
        mesh = bpy.data.objects[name].data
        found = find_uv_map(mesh, map_name)
        if found and read_made(mesh).get(found, {}).get("kind") != UV_MAP:
            raise Refused(
                f"{name!r} has a UV map {found!r} that no bake made, so that it is not packed into "
                f"the atlas; use it as it is with --uv-map {found}, or rename it"
            )
