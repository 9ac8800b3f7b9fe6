"""Bias: the solver against the path tracer, at points of random scenes, with standard errors."""

from __future__ import annotations

import time
import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from radiosity_addon.settings import Settings
from radiosity_addon.solver.sequence import solve
from verification.build import small_receivers
from verification.path_tracer import irradiance
from verification.random_scenes import FAMILIES

POINTS = 16  # of a scene
FLOOR = 0.25  # of the mean light: what errors are relative to at least (docs/theory.md, section 8)
TRIAL = 2000  # paths for each point that tell how many are needed
NOISE = 0.004  # of max(own, mean): the tracer's standard error that is aimed at,
MOST = 60_000  # with at most so many paths
LIMIT = 0.003  # of the light: a family's mean bias


@dataclass(frozen=True)
class Truth:
    """Of the tracer: (n, 2) direct and indirect irradiance, means over channels, and errors."""

    light: np.ndarray
    error: np.ndarray

    @property
    def level(self) -> np.ndarray:
        """(n, 1) a point's light, or the scene's mean where that is more."""
        total = self.light.sum(axis=1, keepdims=True)
        return np.maximum(np.maximum(total, total.mean()), 1e-300)

    @property
    def local(self) -> np.ndarray:
        """(n, 1) what the relative error is of."""
        total = self.light.sum(axis=1, keepdims=True)
        return np.maximum(np.maximum(total, FLOOR * total.mean()), 1e-300)


def traced(scene, triangle, uv, seed: int, most: int = MOST) -> Truth:
    """The tracer's answer, with as many paths as a trial says the noise needs."""
    trial = _truth(irradiance(scene, triangle, uv, TRIAL, seed))
    rough = np.sqrt(np.mean((trial.error.sum(axis=1, keepdims=True) / trial.level) ** 2))
    paths = int(np.clip(TRIAL * (rough / NOISE) ** 2, TRIAL, max(most, TRIAL)))
    return _truth(irradiance(scene, triangle, uv, paths, seed + 1))


def _truth(found) -> Truth:
    """Means over channels; their errors add up at most, as channels share their paths."""
    return Truth(np.stack([found.direct.mean(axis=1), found.indirect.mean(axis=1)], 1),
                 np.stack([found.direct_error.mean(axis=1), found.indirect_error.mean(axis=1)], 1)
                 )  # fmt: skip


def measure(
    family: str, number: int, errors, seeds: int, points=POINTS, most=MOST
) -> Iterator[dict]:
    """One scene: a record for each error asked, when it is known."""
    random = np.random.default_rng([zlib.crc32(family.encode()), number])
    build, scene, within = FAMILIES[family](random)
    receivers, triangle, uv = small_receivers(build, scene, points, random, within)
    truth = traced(scene, triangle, uv, 1000 * number, most)
    for asked in errors:
        found, told, start = [], [], time.perf_counter()
        for seed in range(seeds):
            settings = Settings(error=asked, seed=seed, threads=2, passes=("direct", "indirect"))
            solution = solve(scene, receivers, settings)
            found.append([solution.direct.mean(axis=1), solution.indirect.mean(axis=1)])
            told.append(solution.statistics.estimated_error)
        seconds = (time.perf_counter() - start) / seeds
        yield {
            "family": family, "scene": number, "asked": asked, "seconds": seconds,
            **compared(np.array(found).transpose(0, 2, 1), truth), "told": _rms(told),
        }  # fmt: skip


def compared(found: np.ndarray, truth: Truth) -> dict:
    """Of (seeds, n, 2) values: mean signed deviation of direct and indirect light in shares of the
    light, with standard errors; the points' deviations; the true relative error."""
    seeds, points = found.shape[:2]
    apart = (found - truth.light) / truth.level
    mean = apart.mean(axis=0)
    noise = (truth.error / truth.level) ** 2
    if seeds > 1:
        noise = noise + apart.var(axis=0, ddof=1) / seeds
    total = (found - truth.light).sum(axis=2, keepdims=True) / truth.local
    own = (truth.error.sum(axis=1, keepdims=True) / truth.local) ** 2  # of the tracer: not ours
    square = (total**2).mean() - own.mean()
    return {
        "bias": mean.mean(axis=0).tolist(), "noise": (np.sqrt(noise.sum(axis=0)) / points).tolist(),
        "deviation": mean.tolist(), "sigma": np.sqrt(noise).tolist(),
        "measured": float(np.sqrt(max(square, 0))), "own": float(np.sqrt(own.mean())),
    }  # fmt: skip


def _rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


@dataclass(frozen=True)
class Verdict:
    """A family at one error asked, over its scenes."""

    family: str
    asked: float
    scenes: int
    bias: np.ndarray  # (2,) direct, indirect: shares of the light
    error: np.ndarray  # (2,) standard errors
    worst: float  # the largest deviation of a point, as far as it is not noise
    off: int  # points that deviate by more than 4 standard errors and more than was asked
    told: float
    measured: float

    @property
    def unbiased(self) -> bool:
        return bool((np.abs(self.bias) <= np.maximum(LIMIT, 3 * self.error)).all())


def judged(records: list[dict]) -> Verdict:
    """The records are of one family and one error. The bias's standard error is the scatter among
    scenes, or what the points' own noise makes of it where that is more."""
    bias = np.array([r["bias"] for r in records])
    noise = np.sqrt(np.sum(np.square([r["noise"] for r in records]), axis=0)) / len(records)
    scatter = bias.std(axis=0, ddof=1) / np.sqrt(len(bias)) if len(bias) > 1 else 0 * noise
    deviation = np.concatenate([r["deviation"] for r in records])
    sigma, asked = np.concatenate([r["sigma"] for r in records]), records[0]["asked"]
    beyond = np.abs(deviation) > 4 * sigma
    clear = np.where(beyond, deviation, 0).ravel()
    return Verdict(
        records[0]["family"], asked, len(records), bias.mean(axis=0), np.maximum(noise, scatter),
        float(clear[np.argmax(np.abs(clear))]), int((beyond & (np.abs(deviation) > asked)).sum()),
        _rms([r["told"] for r in records]), _rms([r["measured"] for r in records]),
    )  # fmt: skip


def verdicts(records: list[dict]) -> list[Verdict]:
    """For each family and error that occurs."""
    keys = sorted({(r["family"], -r["asked"]) for r in records})
    return [judged([r for r in records if (r["family"], -r["asked"]) == key]) for key in keys]
