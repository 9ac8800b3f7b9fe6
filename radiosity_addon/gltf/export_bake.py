"""From baked objects in the open file to a GLB file with their bake. bpy."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..bake.attribute import FALLBACK
from ..bake.bake_notes import PASSES, SCALE, passes_of
from ..bake.encodings import coding_error, decode, encode, encoding_scale
from ..bake.image import find_baked
from ..bake.png import png_bytes
from ..bake.primaries import to_rec709
from ..bake.uv_maps import find_uv_map
from ..figures import figure, percent
from ..settings import Settings, Target
from ..solver.expected import Refused
from ..solver.passes import Pass
from ..stages.job import Job
from .blender_export import carried, export_glb
from .dress import Dress, Lightmap, dress
from .glb import FLOAT, read_glb, write_glb

ENCODING = "linear"
NOTABLE = 0.01  # error [relative]: a coarser lightmap is warned of


@dataclass(frozen=True)
class Baked:
    """What is to be exported: a bake's target, name, UV map, and whether it holds color, where it noted no passes."""

    objects: tuple[str, ...]
    target: str  # see Target
    name: str
    uv_map: str
    colored: bool
    atlas: str | None = None  # whose images the objects share; None: one for each


def baked_by(job: Job) -> Baked:
    """All objects of a bake."""
    return baked_with(job.settings, tuple(target.name for target in job.targets))


def baked_with(settings: Settings, objects: tuple[str, ...]) -> Baked:
    """These objects, baked with these settings, now or earlier."""
    return Baked(
        objects=objects,
        target=settings.target,
        name=settings.name,
        uv_map=settings.uv_map or Settings().name,
        colored=Pass.COLOR in settings.passes,
        atlas=settings.atlas,
    )


def export_bake(baked: Baked, path: str | Path) -> tuple[str, ...]:
    """Write the open scene to ``path`` with the bake in it; returns warnings.

    The caller puts the file in place. Raises Refused with the exporter's reason, and
    when not one object carries the bake.
    """
    warnings: list[str] = []
    found = _attributes(baked)
    if not found:
        raise Refused(f"no object carries a bake called {baked.name!r}; bake before the export")
    lightmaps = _lightmaps(baked, warnings) if baked.target == Target.IMAGE else None
    names = carried(found.values())
    export_glb(path, set(baked.objects), names)
    glb = read_glb(path)
    by_object = {item: names[attribute] for item, attribute in found.items()}
    dressed = dress(glb, Dress(_colored(baked, found), lightmaps, by_object))
    if baked.target == Target.VERTEX:
        _to_floats(glb)
        warnings += _scale_warning(baked)
    bare = [name for name in baked.objects if name not in dressed]
    if bare:
        warnings.append(
            f"the exported file lacks the bake of {bare[0]!r} ({len(bare)} in all): it is not "
            "rendered in the scene, or its modifiers drop the attribute or UV map"
        )
    write_glb(glb, path)
    return tuple(warnings)


def _attributes(baked: Baked) -> dict[str, str]:
    """By object, what the bake is called on its mesh: as asked for, or what stands in for it."""
    import bpy

    names: dict[str, str] = {}
    for item in map(bpy.data.objects.get, baked.objects):
        if item is None or item.type != "MESH":
            continue
        if baked.target == Target.IMAGE:
            found = find_uv_map(item.data, baked.uv_map)
        else:
            candidates = (baked.name, FALLBACK.format(baked.name))
            found = next((n for n in candidates if n in item.data.color_attributes), None)
        if found is not None:
            names[item.name] = found
    return names


def _colored(baked: Baked, found: dict[str, str]) -> frozenset[str]:
    """The objects whose bake, ``found`` as an attribute of each, holds the surface's own color."""
    passes = {name: _passes(baked, name, attribute) for name, attribute in found.items()}
    return frozenset(name for name, held in passes.items() if (Pass.COLOR in held if held else baked.colored))


def _passes(baked: Baked, name: str, attribute: str) -> tuple[str, ...]:
    """The passes that the bake of an object holds; empty where it was not noted."""
    import bpy

    if baked.target == Target.VERTEX:
        return passes_of(bpy.data.objects[name].data, attribute)
    image = find_baked(baked.name, baked.atlas, name)
    return tuple(filter(None, image.get(PASSES, "").split(","))) if image is not None else ()


def _scale_warning(baked: Baked) -> list[str]:
    """A warning where the colors are divided by a scale, which COLOR_0 has no place for."""
    import bpy

    key = SCALE.format(baked.name)
    items = filter(None, map(bpy.data.objects.get, baked.objects))
    scales = sorted({item.data[key] for item in items if item.data.get(key, 1.0) != 1.0})
    return [
        f"the exported colors are the light divided by {', '.join(map(figure, scales))} (the scale of "
        "byte colors): multiply by that in the engine, or bake floats"
    ] * bool(scales)


def _lightmaps(baked: Baked, warnings: list[str]) -> dict[str, Lightmap]:
    """A PNG for each image, by the names of the objects whose texels it holds."""
    import bpy

    matrix = to_rec709()
    made, images, worst = {}, {}, (0.0, "")
    for name in baked.objects:
        image = find_baked(baked.name, baked.atlas, name)
        if image is None or bpy.data.objects.get(name) is None:
            continue
        if image.name in images:
            made[name] = images[image.name]
            continue
        pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
        image.pixels.foreach_get(pixels)
        pixels = pixels.reshape(image.size[1], image.size[0], 4)
        colors = np.maximum(pixels[..., :3] @ matrix, 0)
        scale = encoding_scale([colors], ENCODING, 0)
        codes = encode(colors, ENCODING, scale)
        on = pixels[..., 3] > 0
        worst = max(worst, (coding_error(colors[on], decode(codes, ENCODING, scale)[on]), name))
        made[name] = Lightmap(image.name, png_bytes(codes, srgb=False), scale)
        images[image.name] = made[name]
    if worst[0] > NOTABLE:
        warnings.append(
            f"8 bits in the exported lightmap of {worst[1]!r} are off by {percent(worst[0])} "
            "before filtering, as its brightest texel is far above the rest; where that is a glowing face, "
            "bake without the emission pass; vertex colors are exported as floats"
        )
    return made


def _to_floats(glb) -> None:
    """Bring COLOR_0 into floats, which Blender writes of float colors alone and Godot 3 takes no other numbers for,
    and into glTF's primaries."""
    matrix = to_rec709()
    same = np.allclose(matrix, np.eye(3), atol=1e-4)  # Blender's default working space
    moved: dict[int, int] = {}
    for mesh in glb.document.get("meshes", []):
        for primitive in mesh["primitives"]:
            index = primitive["attributes"].get("COLOR_0")
            if index is None or (same and glb.document["accessors"][index]["componentType"] == FLOAT):
                continue
            if index not in moved:
                rows = glb.floats(index).copy()
                if not same:
                    rows[:, :3] = np.maximum(rows[:, :3] @ matrix, 0)
                moved[index] = glb.add_floats(rows)
            primitive["attributes"]["COLOR_0"] = moved[index]
