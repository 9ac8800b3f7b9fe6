"""Numerical stability at the extremes, measured: python -m benchmarks.stability

Writes docs/stability.md; ``--only AXIS`` prints one axis and ``--scenes N`` tries that many random
scenes; both write nothing.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.machine import commit
from benchmarks.scenes import SceneMissing
from benchmarks.stability_real import CASES as REAL
from verification.stability_cases import CASES, Case
from verification.stability_measures import random_failures

ALL = (*CASES, *REAL)
MISSING = float("nan")
PAGE = Path(__file__).resolve().parents[1] / "docs" / "stability.md"
INTRODUCTION = """# Numerical stability at the extremes

What was tried, what must hold (an exact answer or an invariant), and the largest deviation seen,
as a share of the answer; where the answer is 0, the brightest value found. Regenerate with
`python -m benchmarks.stability`.

"""


@dataclass(frozen=True)
class Row:
    """One case, measured."""

    case: Case
    deviation: float  # MISSING where the case's file is not here
    seconds: float

    @property
    def held(self) -> bool:
        return self.deviation <= self.case.limit

    @property
    def verdict(self) -> str:
        """The deviation, and whether it is too much."""
        if np.isnan(self.deviation):
            return "its file is not here"
        return f"{self.deviation:.2g}" + ("" if self.held else " **not met**")


def measure(case: Case) -> Row:
    """Run one case; a deviation that is no number is an infinite one."""
    start = time.perf_counter()
    try:
        deviation = float(case.measure())
    except SceneMissing:
        return Row(case, MISSING, 0.0)
    return Row(case, np.inf if np.isnan(deviation) else deviation, time.perf_counter() - start)


def table(rows: list[Row]) -> str:
    """Markdown."""
    heads = ("axis", "tried", "must hold", "allowed", "largest deviation", "seconds")
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    for row in rows:
        case = row.case
        lines.append(
            f"| {case.axis} | {case.tried} | {case.holds} | {case.limit:g} | {row.verdict} "
            f"| {row.seconds:.1f} |"
        )
    return "\n".join(lines) + "\n"


def page(rows: list[Row], notes: str) -> str:
    """The whole of docs/stability.md."""
    held = sum(row.held for row in rows)
    return (
        f"{INTRODUCTION}{table(rows)}\n"
        f"{held} of {len(rows)} rows hold (commit {commit()}).\n{notes}"
    )


def main(argv: list[str] | None = None) -> int:
    """Measure all cases, or one axis; 1 where one does not hold."""
    parser = argparse.ArgumentParser(prog="benchmarks.stability", description=__doc__)
    parser.add_argument("--only", metavar="AXIS", help="print this axis alone")
    parser.add_argument("--scenes", metavar="N", type=int, help="check N random scenes alone")
    arguments = parser.parse_args(argv)
    if arguments.scenes:
        return int(random_failures(arguments.scenes))
    only, rows = arguments.only, []
    for case in ALL:
        if only in (None, case.axis):
            rows.append(measure(case))
            print(f"{rows[-1].deviation:10.2e}  {rows[-1].seconds:6.1f} s  {case.name}", flush=True)
    if only is None:
        PAGE.write_text(page(rows, _notes()), encoding="utf-8")
    return 0 if all(row.held for row in rows) else 1


def _notes() -> str:
    """What follows the table; kept when the page is written anew."""
    if not PAGE.exists():
        return ""
    _, mark, notes = PAGE.read_text(encoding="utf-8").partition("\n## ")
    return mark + notes


if __name__ == "__main__":
    sys.exit(main())
