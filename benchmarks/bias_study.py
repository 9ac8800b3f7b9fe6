"""Bias: the solver against the independent path tracer, at points of random scenes.

    python -m benchmarks.bias_study [--families NAME…] [--scenes N] [--seeds N] [--seconds S] [--out FILE.jsonl]

Every error asked of a scene is a line of ``--out``; what is in there is not done again, so that a run may be
stopped, or stops by itself after ``--seconds``, and gone on with. Delete the file when the solver has
changed. docs/bias.md is written from all lines, unless ``--no-page``.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import numpy as np

from benchmarks.machine import commit
from verification.bias import LIMIT, MOST, POINTS, measure, verdicts
from verification.random_scenes import FAMILIES

LEAST = 1e-4  # error [relative]: what is measured below it is the tracer's noise
PAGE = Path(__file__).resolve().parents[1] / "docs" / "bias.md"
def page(records: list[dict]) -> str:
    """docs/bias.md."""
    lines = [INTRODUCTION, "| family | asked | scenes | direct, % | indirect, % | worst point, % "
             "| points off | estimated / measured |", "|---|---|---|---|---|---|---|---|"]  # fmt: skip
    found = verdicts(records)
    for v in found:
        both = [f"{100 * b:+.2f} ± {100 * e:.2f}" for b, e in zip(v.bias, v.error)]
        mark = "" if v.unbiased else " **biased**"
        lines.append(f"| {v.family.replace('_', ' ')} | {100 * v.asked:g} % | {v.scenes} "
                     f"| {both[0]} | {both[1]}{mark} | {100 * v.worst:+.1f} | {v.off} "
                     f"| {f'{v.told / v.measured:.2f}' if v.measured > LEAST else '–'} |")  # fmt: skip
    good = sum(v.unbiased and v.off == 0 for v in found)
    lines.append(f"\n{good} of {len(found)} rows hold.\n")
    lines += by_commit(records)
    return "\n".join(lines) + "\n"


def by_commit(records: list[dict]) -> list[str]:
    """The lines of a table: all families together, of each commit."""
    lines = ["| commit | asked | scenes | estimated, % | measured, % |", "|---|---|---|---|---|"]
    for key in sorted({(r["commit"], -r["asked"]) for r in records}):
        some = [r for r in records if (r["commit"], -r["asked"]) == key]
        told, measured = (100 * np.sqrt(np.mean([r[name] ** 2 for r in some])) for name in ("told", "measured"))
        lines.append(f"| {key[0]} | {-100 * key[1]:g} % | {len(some)} | {told:.2f} | {measured:.2f} |")
    return lines


INTRODUCTION = f"""# Bias, measured by an independent path tracer

Random scenes of many families (`verification/random_scenes.py`), some points of each, solved for
the errors asked and traced by `verification/path_tracer.py`, which shares no code with the solver.
Regenerate with `python -m benchmarks.bias_study`.

*direct*, *indirect*: the mean over scenes, points and seeds of our light less the tracer's, in
shares of the point's light (or the scene's mean, where that is more), with its standard error.
*biased*: more than {100 * LIMIT:g} % and more than three standard errors. *worst point*: the
largest deviation beyond four standard errors. *points off*: deviations of direct or indirect light
beyond four standard errors and beyond the error asked. *estimated / measured*: the solver's estimate
over its true relative error, both in the mean square; a dash where the tracer's noise hides it. The last
table has both for all families together, in root mean squares over scenes, by the commit that they were solved at.
"""


def read(path: Path) -> list[dict]:
    """The records of a file, the last of each scene and error; none where it is not there."""
    if not path.exists():
        return []
    records = map(json.loads, path.read_text(encoding="utf-8").splitlines())
    return list({(r["family"], r["scene"], r["asked"]): r for r in records}.values())


def main(argv: list[str] | None = None) -> int:
    """Measure what is missing, print each scene, write the page; 1 where a row does not hold."""
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser("benchmarks.bias_study", description=__doc__, formatter_class=raw)
    parser.add_argument("--families", nargs="+", choices=FAMILIES, default=list(FAMILIES))
    parser.add_argument("--scenes", type=int, default=20)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--points", type=int, default=POINTS)
    parser.add_argument("--paths", type=int, default=MOST, help="at most, for each point")
    parser.add_argument("--errors", type=float, nargs="+", default=[0.03, 0.01])
    parser.add_argument("--seconds", type=float, default=float("inf"), help="then no scene begins")
    parser.add_argument("--out", type=Path, default=PAGE.parent / "figures" / "bias.jsonl")
    parser.add_argument("--no-page", action="store_true")
    arguments = parser.parse_args(argv)
    records = read(arguments.out)
    for record in measured_anew(arguments, records):
        records.append(record)
        with arguments.out.open("a", encoding="utf-8") as file:
            file.write(json.dumps(record) + "\n")
        print(line(record), flush=True)
    if not arguments.no_page:
        PAGE.write_text(page(records), encoding="utf-8")
    return 0 if all(v.unbiased and v.off == 0 for v in verdicts(records)) else 1


def measured_anew(arguments: argparse.Namespace, records: list[dict]) -> Iterator[dict]:
    """What is not among the ``records`` yet, scene after scene of all families in turn; no scene begins after
    ``arguments.seconds``."""
    start, done = time.monotonic(), {(r["family"], r["scene"], r["asked"]) for r in records}
    for number, family in product(range(arguments.scenes), arguments.families):
        errors = [e for e in arguments.errors if (family, number, e) not in done]
        if not errors or time.monotonic() - start > arguments.seconds:
            continue
        for record in measure(family, number, errors, arguments.seeds, arguments.points, arguments.paths):
            yield {**record, "commit": commit()}


def line(record: dict) -> str:
    """For people who wait."""
    pairs = " ".join(f"{name} {100 * b:+6.2f} ± {100 * n:.2f} %" for name, b, n in
                     zip(("direct", "indirect"), record["bias"], record["noise"]))  # fmt: skip
    return (f"{record['family']:18s} {record['scene']:3d} {100 * record['asked']:g} %: {pairs}, "
            f"estimated {100 * record['told']:.2f}, measured {100 * record['measured']:.2f} %, "
            f"{record['seconds']:.1f} s")  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
