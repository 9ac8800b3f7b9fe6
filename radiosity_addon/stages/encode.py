"""Encode: what becomes of a bake's colors in 8 or 16 bits, and by which scale. Imports no bpy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..bake.encodings import BITS, ONE, coding_error, decode, encode, encoding_scale, share_above
from ..figures import figure, percent
from ..settings import Target
from ..solver.workers.parallel import ranges
from .job import Job, Result
from .spool import drop_pages

MOST_JUDGED = 2_000_000  # number [colors]: of more, evenly spaced ones are judged
BAND = 1 << 23  # number [values] that are looked at together
BYTE_ENCODING = "png"  # Blender's BYTE_COLOR: 8 bits, sRGB
REMEDY = {
    "byte": "--scale auto, or --color-type float",
    "image": "--scale auto, or --format exr, hdr, rgbm or rgbe",
}


@dataclass(frozen=True)
class Encoding:
    """How values are encoded: divided by ``scale``, then as ``name`` of bake.encodings."""

    name: str | None  # None: 32-bit floats, nothing is encoded
    scale: float
    share_above: float  # of the colors have a channel above the scale, which is cut
    error: float  # that the encoding alone brings, relative, root mean square
    warnings: tuple[str, ...]


def encoding_of(
    job: Job, result: Result, matrix: np.ndarray, most_judged: int = MOST_JUDGED, band: int = BAND
) -> Encoding:
    """The encoding of a bake; ``matrix`` (3, 3) leads from its colors to the file's primaries.

    One scale for all objects, so that their brightness can be compared. Its error is found from
    ``most_judged`` colors at most; ``band`` values are looked at together.
    """
    name = encoding_name(job.settings)
    if name is None:
        return Encoding(None, 1.0, 0.0, 0.0, ())
    matrix = np.eye(3) if job.settings.target == Target.VERTEX else matrix
    counts, peaks = zip(*((len(c), c.max(initial=0.0)) for c in _bands(result, matrix, band)))
    count, peak = sum(counts), np.max(peaks, keepdims=True)
    scale = encoding_scale([peak], name, job.settings.scale)
    every, first, above, judged = 1 + count // most_judged, 0, 0.0, []
    for colors in _bands(result, matrix, band):  # in float64, which of all together would be a lot
        judged.append(colors[-first % every :: every])
        above += share_above(colors, scale) * len(colors) / max(count, 1)
        first += len(colors)
    above = 0.0 if name in ONE else above
    judged = np.concatenate(judged)
    error = coding_error(judged, decode(encode(judged, name, scale), name, scale))
    return Encoding(name, scale, above, error, _warn(job, name, scale, above, float(peak[0])))


def encoding_name(settings) -> str | None:
    """The encoding that the settings ask for; None for floats."""
    if settings.target == Target.VERTEX:
        return BYTE_ENCODING if settings.color_type == "byte" else None
    return settings.format if settings.image_dir and settings.format in BITS else None


def _bands(result: Result, matrix: np.ndarray, band: int):
    """(n, 3) float64 colors times ``matrix``, some rows of each mesh or image at a time."""
    for colors in result.colors:
        for rows in ranges(len(colors), max(band * len(colors) // max(colors.size, 1), 1)):
            yield _covered(colors[rows]) @ matrix
        drop_pages(colors)


def _covered(colors: np.ndarray) -> np.ndarray:
    """(n, 3) float64: the colors of a mesh, or of an image's texels that belong to a face."""
    if colors.ndim == 3:
        colors = colors[colors[..., 3] > 0]
    return colors[:, :3].astype(np.float64)


def _warn(job: Job, name: str, scale: float, above: float, peak: float) -> tuple[str, ...]:
    """A warning where a share ``above`` the scale is cut."""
    if not above:
        return ()
    vertex = job.settings.target == Target.VERTEX
    where = "byte color attribute" if vertex else f"{name} files"
    return (
        f"{percent(above)} of the {'colors' if vertex else 'texels'} lie above {figure(scale)} "
        f"(the brightest at {figure(peak)}) and are cut in the {where}; use "
        + REMEDY["byte" if vertex else "image"],
    )
