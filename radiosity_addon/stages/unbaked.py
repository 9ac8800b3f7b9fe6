"""Unbaked: what an atlas' images hold of objects that are not baked now. bpy."""

from __future__ import annotations

import numpy as np

from ..bake.bake_notes import PASSES
from ..bake.image import find_image
from ..bake.windows import objects_of_image
from ..settings import Settings
from ..solver.expected import Refused
from .job import Job, UnbakedTexels
from .sheets import sheets_of


def unbaked_texels(job: Job) -> dict[str, UnbakedTexels]:
    """What the atlas' images hold of objects that are not baked now, by the name of the sheet.

    Raises Refused where it could not stand beside what is baked.
    """
    import bpy

    baked, found = {target.name for target in job.targets}, {}
    for sheet in sheets_of(job):
        image = find_image(f"{job.settings.name}_{sheet.name}")
        if image is None:
            continue
        others = [n for n in objects_of_image(image) if n not in baked and n in bpy.data.objects]
        if not others:
            continue
        _check_beside(image, sheet.size, others, job.settings)
        pixels = np.empty(4 * image.size[0] * image.size[1], np.float32)
        image.pixels.foreach_get(pixels)
        shape = image.size[1], image.size[0], 4
        found[sheet.name] = UnbakedTexels(pixels.reshape(shape), tuple(others))
    return found


def _check_beside(image, size: tuple[int, int], others: list[str], settings: Settings) -> None:
    """Raise Refused where an image cannot keep the texels of ``others`` beside what is baked."""
    rest = f"{others[0]!r} ({len(others)} in all), which is not baked now"
    if tuple(image.size) != size:
        width, height = image.size
        raise Refused(
            f"image {image.name!r} has {width} x {height} texels and {size[0]} x {size[1]} are asked "
            f"for; it also holds {rest}: bake all of them together, or name --resolution "
            f"{width}x{height}"
        )
    passes = ",".join(settings.passes)
    if image.get(PASSES, passes) != passes:
        raise Refused(
            f"image {image.name!r} holds the passes {image[PASSES]} of {rest}: bake the same "
            "passes, all of them together, or under another --name"
        )
