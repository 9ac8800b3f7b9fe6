"""Numerical stability at the extremes, measured: python -m benchmarks.stability

Writes docs/stability.md; ``--only AXIS`` prints one axis and writes nothing.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from benchmarks.machine import commit
from benchmarks.stability_cases import CASES, Case

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
    deviation: float
    seconds: float

    @property
    def held(self) -> bool:
        return self.deviation <= self.case.limit


def measure(case: Case) -> Row:
    """Run one case."""
    start = time.perf_counter()
    deviation = float(case.measure())
    return Row(case, deviation, time.perf_counter() - start)


def table(rows: list[Row]) -> str:
    """Markdown."""
    lines = ["| axis | tried | must hold | allowed | largest deviation | seconds |", "|---|" * 1]
    lines[1] = "|---|---|---|---|---|---|"
    for row in rows:
        case = row.case
        verdict = f"{row.deviation:.2g}" + ("" if row.held else " **not met**")
        lines.append(
            f"| {case.axis} | {case.tried} | {case.holds} | {case.limit:g} | {verdict} "
            f"| {row.seconds:.1f} |"
        )
    return "\n".join(lines) + "\n"


def page(rows: list[Row], notes: str) -> str:
    """The whole of docs/stability.md."""
    held = sum(row.held for row in rows)
    return (
        f"{INTRODUCTION}{table(rows)}\n{held} of {len(rows)} rows hold (commit {commit()}).\n{notes}"
    )


def main(argv: list[str] | None = None) -> int:
    """Measure all cases, or one axis; 1 where one does not hold."""
    parser = argparse.ArgumentParser(prog="benchmarks.stability", description=__doc__)
    parser.add_argument("--only", metavar="AXIS", help="print this axis alone")
    only = parser.parse_args(argv).only
    rows = []
    for case in CASES:
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
