"""The report: what was baked, to what error, at what cost. A plain dict, JSON, and five lines."""

from __future__ import annotations

import json
import math
from pathlib import Path

from . import __version__
from .figures import figure, percent, quoted
from .stages.encode import Encoding
from .stages.job import Job, Result

PHASES = ("elements", "transport", "solve", "gather")  # timed by the solver
SHOWN = 5  # number [warnings, objects left out] on the terminal
ENERGY = ("emitted", "absorbed", "escaped")  # [W]


def build_report(
    job: Job, result: Result, seconds: dict, peak_memory: int, encoding: Encoding | None = None
) -> dict:
    """The report as a dict of plain values, with the keys that scripts rely on.

    ``seconds``: ``export``, ``write`` and ``total`` as the caller timed them; the other phases
    are the solver's. ``peak_memory`` in bytes. ``encoding``: that of the files or byte colors; its
    error and the solver's have nothing to do with each other, so that their squares add.
    """
    figures = result.statistics
    return {
        "version": __version__,
        "triangles": len(job.scene.triangles),
        "elements": int(figures.elements),
        "receivers": int(result.receivers),
        "rays": int(figures.rays),
        "iterations": int(figures.iterations),
        "residual": float(figures.residual),
        "target_error": float(job.settings.target_error),
        "estimated_error": float(figures.estimated_error),
        "error_95": float(figures.error_95),
        "encoded_error": math.hypot(figures.estimated_error, encoding.error if encoding else 0.0),
        "scale": float(encoding.scale) if encoding else 1.0,
        "energy": {name: float(figures.energy.get(name, 0.0)) for name in ENERGY},
        "seconds": _seconds(figures.seconds, seconds),
        "peak_memory": int(peak_memory),
        "objects": _objects(job),
        "warnings": list(dict.fromkeys((*job.warnings, *result.warnings))),
    }


def write_report(report: dict, path: str | Path) -> None:
    """Write the report as JSON; a number that is not finite becomes null, as JSON has none."""
    text = json.dumps(_finite(report), indent=2, ensure_ascii=False, allow_nan=False)
    Path(path).write_text(text + "\n", encoding="utf-8")


def summarize(report: dict, output: str) -> str:
    """Five lines for people: what, how much work, how right, how long, what to look at; objects
    that were left out, and several warnings, have lines of their own."""
    baked = sum(entry["baked"] for entry in report["objects"])
    left_out = [each for each in report["objects"] if not each["baked"]]
    energy, seconds, warnings = report["energy"], report["seconds"], report["warnings"]
    return "\n".join(
        [
            f"Baked {_count(baked, 'object')} into {output}"
            + (f", {_count(len(left_out), 'object')} left out:" if left_out else ""),
            *_shown(by_reason(left_out)),
            f"Work: {_count(report['triangles'], 'triangle')}, "
            f"{_count(report['elements'], 'element')}, "
            f"{_count(report['receivers'], 'receiver')}, {_count(report['rays'], 'ray')}",
            f"Relative error: {percent(report['estimated_error'])} estimated, "
            f"{percent(report['target_error'])} asked; "
            f"95 % of the surface within {percent(report['error_95'])}; energy "
            + ", ".join(f"{figure(energy[name])} W {name}" for name in ENERGY),
            f"Time: {seconds['total']:.2f} s ({_phases(seconds)}); "
            f"memory {report['peak_memory'] / 2**20:.0f} MB",
            f"Warnings: {_warnings(warnings)}",
        ]
    )


def _seconds(solver: dict, caller: dict) -> dict:
    phases = {name: float(solver.get(name, 0.0)) for name in PHASES}
    return {
        "export": float(caller["export"]),
        **phases,
        "write": float(caller["write"]),
        "total": float(caller["total"]),
    }


def _objects(job: Job) -> list[dict]:
    baked = [{"name": target.name, "baked": True, "reason": ""} for target in job.targets]
    return baked + [
        {"name": name, "baked": False, "reason": reason} for name, reason in job.skipped
    ]


def _finite(value):
    """The same structure with None in place of NaN and infinities."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _count(number: int, word: str) -> str:
    return f"{number:,} {word}{'' if number == 1 else 's'}"


def _phases(seconds: dict) -> str:
    return ", ".join(
        f"{name} {value:.2f}" for name, value in seconds.items() if name != "total"
    )


def _warnings(warnings: list[str]) -> str:
    if not warnings:
        return "none"
    if len(warnings) == 1:
        return warnings[0]
    return "\n".join([str(len(warnings)), *_shown(warnings)])


def by_reason(objects: list[dict]) -> list[str]:
    """A line for each reason why ``objects`` of a report are left out, with the names of the first that
    it holds for."""
    names: dict[str, list[str]] = {}
    for each in objects:
        names.setdefault(each["reason"], []).append(each["name"])
    return [
        quoted(found) + (f", each: {reason}" if len(found) > 1 else f": {reason}")
        for reason, found in names.items()
    ]


def _shown(texts: list[str]) -> list[str]:
    """The first of them, each a line of its own, and how many more there are."""
    more = len(texts) - SHOWN
    rest = [f"and {more} more (--report has all)"] if more > 0 else []
    return [f"  {text}" for text in (*texts[:SHOWN], *rest)]
