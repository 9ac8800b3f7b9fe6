"""Cycles at a ladder of sample counts, in error and time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from verification.error import Measured, relative_error

from .cycles import cycles_bake
from .denoise import denoise
from .references import References

SEED = 7  # none of the references'


@dataclass(frozen=True)
class Rung:
    """One bake: who made it, with what effort, in how many seconds and how well."""

    method: str
    effort: str
    seconds: float
    error: Measured


def cycles_ladder(
    obj, size, references: References, comparable, passes, samples, uv_map="Radiosity"
) -> list[Rung]:
    """Cycles plain, and after Open Image Denoise where that is installed, at each sample count."""
    rungs = []
    for count in samples:
        pixels, mask, seconds = cycles_bake(obj, size, count, SEED, passes, uv_map)
        rungs.append(judged("Cycles", f"{count} samples", seconds, pixels, references, comparable))
        denoised = denoise(pixels, mask)
        if denoised is not None:
            smooth, extra = denoised
            rungs.append(judged("Cycles + OIDN", f"{count} samples", seconds + extra, smooth,
                                references, comparable))  # fmt: skip
    return rungs


def judged(method, effort, seconds, pixels, references: References, comparable) -> Rung:
    """A rung from an image (size, size, 3) and the mask of texels that can be compared."""
    error = relative_error(pixels[comparable], references.a[comparable], references.b[comparable])
    return Rung(method, effort, seconds, error)


def seconds_for(error: float, rungs: list[Rung], method: str = "Cycles") -> float:
    """The time ``method`` needs for an error: log-log interpolation between its rungs.

    Beyond the last rung plain Cycles converges as 1/√samples, so time grows as 1/error²; denoised
    Cycles is extended with its last slope, or counted as never (inf) where it no longer improves.
    """
    mine = sorted((r for r in rungs if r.method == method and r.error.error > 0),
                  key=lambda r: r.seconds)  # fmt: skip
    if not mine:
        return float("nan")
    errors, seconds = np.array([(r.error.error, r.seconds) for r in mine]).T
    reached = np.flatnonzero(errors <= error)
    if reached.size and reached[0] == 0:
        return float(seconds[0])
    if reached.size:
        k = reached[0]
        slope = np.log(seconds[k] / seconds[k - 1]) / np.log(errors[k - 1] / errors[k])
        return float(seconds[k - 1] * (errors[k - 1] / error) ** slope)
    slope = 2.0
    if method != "Cycles" and len(mine) > 1:
        gain = np.log(errors[-2] / errors[-1])
        slope = np.log(seconds[-1] / seconds[-2]) / gain if gain > 0 else np.inf
    return float(seconds[-1] * (errors[-1] / error) ** max(slope, 2.0))


def table(rungs: list[Rung]) -> str:
    """Lines of text, one a rung."""
    lines = [f"{'method':<16}{'effort':<24}{'seconds':>9}   relative error"]
    lines += [f"{r.method:<16}{r.effort:<24}{r.seconds:>9.2f}   {r.error}" for r in rungs]
    return "\n".join(lines)
