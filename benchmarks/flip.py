"""FLIP of baked views: our bakes and Cycles' beside a path-traced view of the same matte scene.

    python -m benchmarks.flip [--scenes room living_room] [--errors 0.03 0.01] [--size 512]
                              [--samples 64] [--truth 256] [--width 512] [--folder pictures]

FLIP (Andersson et al. 2020) tells how far two pictures look apart, from 0 to 1, when one flips between
them. The view is path-traced twice, and the mean of both is what bakes are compared with: the line of the second beside
the first tells the noise, of which about 0.7 is in every line. Where faces are doubled, nearly or exactly, Cycles leaves one black, in views and
in its bakes: where faces lie on one another, and where its bake is exactly black, nothing is compared. Needs bpy and the
package ``flip-evaluator``; denoises where ``pyoidn`` is installed. All views are kept in the folder, where path-traced
ones of the same samples and width are not made again.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.ndimage import binary_dilation

from radiosity_addon.bake.dilate import dilated
from verification.comparable_texels import doubled_texels

from .cycles import cycles_bake
from .denoise import denoise
from .look import picture, show
from .our_bake import our_bake, warm_up
from .scenes import SCENES, build

EXPOSURE = {"living_room": 1.5, "room": 1.5}  # stops
MARGIN = 8  # texels
BOUNCES = 64


@dataclass(frozen=True)
class Row:
    """How far a picture is from the path-traced one, and the seconds that its bake took."""

    name: str
    mean: float
    most: float  # that 95 % of the picture stay below
    seconds: float


def flip(truth: Path, other: Path, counts: np.ndarray) -> tuple[float, float]:
    """The mean and the 95th percentile of FLIP over the pixels that ``counts`` (h, w) bool. FLIP blurs
    pictures as eyes do: what does not count is made alike in both, or it would count in the pixels around."""
    from flip_evaluator import evaluate

    both = _pixels(truth), _pixels(other)
    both[1][~counts] = both[0][~counts]
    errors, _, _ = evaluate(*map(np.ascontiguousarray, both), "LDR", applyMagma=False)
    errors = np.asarray(errors).reshape(counts.shape)[counts]
    return float(errors.mean()), float(np.quantile(errors, 0.95))


def bakes(obj, size: int, errors, samples: int):
    """(name, pixels (size, size, 3), seconds) of every bake."""
    for error in errors:
        bake = our_bake(obj, size, error)
        yield f"ours, {100 * error:g} %", bake.pixels, bake.seconds
    pixels, mask, seconds = cycles_bake(obj, size, samples)
    yield f"Cycles, {samples} samples", _extended(pixels, mask), seconds
    found = denoise(pixels, mask)
    if found is not None:
        yield f"Cycles, {samples} samples, denoised", _extended(found[0], mask), seconds + found[1]


def _extended(pixels: np.ndarray, mask: np.ndarray) -> np.ndarray:
    return dilated(pixels.astype(np.float32), mask, MARGIN)[0][..., :3]


def measure(name: str, chosen: argparse.Namespace) -> Iterator[Row]:
    """Bake the scene in every way and look at it from its view."""
    chosen.folder.mkdir(parents=True, exist_ok=True)
    obj, size, truth = build(SCENES[name]), chosen.size, chosen.truth

    def look(file: str, **options) -> Path:
        path = chosen.folder / f"{name}_{chosen.width}_{file}.png"
        if "seed" not in options or not path.exists():
            picture(name, path, chosen.width, EXPOSURE.get(name, 0.0), **options)
        return path

    traced = [look(f"traced_{truth}_{seed}", samples=truth, bounces=BOUNCES, seed=seed) for seed in (1, 2)]
    found = list(bakes(obj, size, chosen.errors, chosen.samples))
    uncounted = np.zeros((size, size), bool)
    if SCENES[name].doubled:
        cycles = next(pixels for way, pixels, _ in found if way.startswith("Cycles"))
        uncounted = doubled_texels(obj, size) | binary_dilation(cycles.max(axis=2) <= 0, iterations=2)
    show(obj, np.repeat(uncounted[..., None], 3, axis=2).astype(float))
    counts = _pixels(look("doubled")).max(axis=2) == 0
    yield Row("path-traced again", *flip(*traced, counts), 0.0)
    both = _mean(traced, chosen.folder / f"{name}_{chosen.width}_traced_{truth}.png")
    for number, (way, pixels, seconds) in enumerate(found):
        show(obj, pixels)
        yield Row(way, *flip(both, look(f"bake{number}"), counts), seconds)


def _mean(paths: list[Path], path: Path) -> Path:
    """The mean of pictures, as their files have it, in a picture of its own."""
    import bpy

    values = np.mean([_pixels(each) for each in paths], axis=0)[::-1]
    height, width = values.shape[:2]
    image = bpy.data.images.new(path.stem, width, height)
    image.pixels.foreach_set(np.dstack([values, np.ones((height, width))]).astype(np.float32).ravel())
    image.filepath_raw, image.file_format = str(path), "PNG"
    image.save()
    bpy.data.images.remove(image)
    return path


def _pixels(path: Path) -> np.ndarray:
    """(h, w, 3) a picture as its file has it, row 0 on top."""
    import bpy

    image = bpy.data.images.load(str(path))
    width, height = image.size
    values = np.empty(4 * width * height, np.float32)
    image.pixels.foreach_get(values)
    bpy.data.images.remove(image)
    return values.reshape(height, width, 4)[::-1, :, :3]


def main(arguments=None) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.flip", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    parser.add_argument("--scenes", nargs="+", choices=list(SCENES), default=["room", "living_room"])
    parser.add_argument("--errors", type=float, nargs="+", default=[0.03, 0.01])
    parser.add_argument("--size", type=int, default=512, help="texels of the image's edge")
    parser.add_argument("--samples", type=int, default=64, help="of Cycles' bake")
    parser.add_argument("--truth", type=int, default=256, help="samples of the path-traced view")
    parser.add_argument("--width", type=int, default=512, help="pixels of the view")
    parser.add_argument("--folder", type=Path, default=Path(tempfile.gettempdir()) / "radiosity_flip",
                        help="of the pictures")  # fmt: skip
    chosen = parser.parse_args(arguments)
    warm_up()
    print("| scene | bake | FLIP, mean | 95th percentile | seconds |\n|---|---|---|---|---|")
    for name in chosen.scenes:
        for row in measure(name, chosen):
            print(f"| {name} | {row.name} | {row.mean:.4f} | {row.most:.4f} | {row.seconds:.1f} |", flush=True)


if __name__ == "__main__":
    main()
