"""Windows: which image an object's texels are in, and which part of it. NumPy only.

An atlas is one image, or a few, for several objects. Each object has a window of it: the texels
around its own UVs. Inside its window it is baked as if it had an image of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..settings import RESOLUTION_RANGE
from ..solver.expected import Refused
from ..solver.geometry.planar import cell_areas
from .bake_notes import OWNER, read_made

RESOLUTION = "radiosity_resolution"  # custom property on objects: edge, or width and height
DENSITY = "radiosity_density"  # custom property on objects: factor of the atlas' texel density
LEAST, LARGEST = RESOLUTION_RANGE


@dataclass(frozen=True)
class TexelRect:
    """A window of an image, in texels from the image's lower left corner."""

    sheet: str | None  # what the image is called after the bake's name; None: the object's name
    size: tuple[int, int]  # width and height of the image
    column: int
    row: int
    width: int  # of the window
    height: int


def full_rect(size: tuple[int, int]) -> TexelRect:
    """An image of the object's own."""
    return TexelRect(None, size, 0, 0, *size)


def window(sheet: str, size: tuple[int, int], uv: np.ndarray) -> tuple[TexelRect, np.ndarray]:
    """The part of an image of ``size`` [texels] that holds the UVs ``uv`` (n, 3, 2), and the UVs as 0 to 1 over that part."""
    points = np.where(np.isfinite(uv), uv, 0.5) * size
    flat = points.reshape(-1, 2)
    low = np.clip(np.floor(flat.min(0)), 0, np.subtract(size, 1)).astype(int)
    high = np.clip(np.ceil(flat.max(0)), low + 1, size).astype(int)
    extent = high - low
    rect = TexelRect(sheet, tuple(size), *low.tolist(), *extent.tolist())
    return rect, (uv * size - low) / extent


def texels_covered(rect: TexelRect, uv: np.ndarray) -> float:
    """How many texels of ``rect`` triangles ``uv`` (n, 3, 2), 0 to 1 over it, cover; overlaps count again."""
    return float(cell_areas(np.nan_to_num(uv), False).sum() / 2 * rect.width * rect.height)


def sheet_name(atlas: str, number: int) -> str:
    """The name of an atlas' image of this number, the first being 1."""
    return atlas if number == 1 else f"{atlas}_{number}"


def sheet_of(item, uv_map: str, settings) -> tuple[str | None, tuple[int, int]]:
    """(sheet, size) of the image that the texels of ``item`` are in."""
    if settings.atlas is None:
        return None, own_size(item, settings.size)
    if settings.uv_map is not None:
        return settings.atlas, settings.size
    facts = read_made(item.data).get(uv_map, {})
    if facts.get("atlas") != settings.atlas:
        return settings.atlas, settings.size
    return sheet_name(settings.atlas, facts["sheet"]), tuple(facts["size"])


def own_size(item, default: tuple[int, int]) -> tuple[int, int]:
    """Width and height of the object's own image: its custom property, or the ``default``.

    Raises Refused for a property that is no resolution.
    """
    value = item.get(RESOLUTION)
    if value is None:
        return default
    try:
        numbers = [int(n) for n in (value if hasattr(value, "__len__") else (value, value))]
    except (TypeError, ValueError):
        numbers = []
    if numbers == [0, 0]:
        return default
    if len(numbers) != 2 or not all(LEAST <= n <= LARGEST for n in numbers):
        raise Refused(
            f"{item.name!r}: its property {RESOLUTION} is {value!r}; make it one or two whole "
            f"numbers from {LEAST} to {LARGEST}, or remove it"
        )
    return numbers[0], numbers[1]


def density_factor(item) -> float:
    """By how much the object's texels are denser than the atlas'. Raises Refused for what is
    no number from 0.001 to 1000."""
    value = item.get(DENSITY, 1.0)
    try:
        factor = float(value)
    except (TypeError, ValueError):
        factor = 0.0
    if not 1e-3 <= factor <= 1e3:
        raise Refused(
            f"{item.name!r}: its property {DENSITY} is {value!r}; make it a number from 0.001 to "
            "1000, or remove it"
        )
    return factor


def objects_of_image(image) -> list[str]:
    """Names of the objects that an image was baked for."""
    return [name for name in str(image.get(OWNER, "")).split("\n") if name]
