"""The study: scenes × errors × seeds, ours beside Cycles, in one run.

    python -m benchmarks.study [--quick] [--scenes cornell street] [--errors 0.03 0.01]
                               [--seeds 0 1 2 3 4] [--samples 4 16 64 256] [--budget 3600]
                               [--reference 512]

Measures against two independent Cycles references, or the exact solution where there is one;
Open Image Denoise is a rival where ``pyoidn`` is installed. Writes study.csv into the output
folder, the plots beside docs/trade.md, and that page (see trade.py); needs matplotlib for plots.
"""

from __future__ import annotations

import argparse
import csv
import time
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path

import numpy as np

from radiosity_addon.solver.workers.parallel import thread_count
from verification.comparable_texels import comparable_texels, doubled_texels, triangle_uvs
from verification.error import Measured, least_measurable, reference_noise, relative_error

from .ladder import cycles_ladder
from .machine import machine
from .our_bake import our_bake, warm_up
from .references import References, cycles_references
from .scenes import SCENES, SceneMissing, StudyScene, build

PASSES = ("emit", "direct", "indirect", "color")
DOCS = Path(__file__).resolve().parent.parent / "docs"
MEASURABLE = 0.4  # share [of the error asked for] that noise of references may pass for, at most
QUICK = {"errors": [0.1, 0.03], "seeds": [0], "samples": [4, 16]}
QUICK_SCENES = ("cornell", "street", "furnace")
QUICK_SIZE, QUICK_REFERENCE = 96, 128


@dataclass(frozen=True)
class Row:
    """One bake. ``asked``: the error asked of us, or Cycles' samples."""

    scene: str
    method: str
    asked: float
    seed: int
    seconds: float
    measured: float
    uncertainty: float
    estimated: float = float("nan")
    embree_seconds: float = float("nan")  # that it would take alone, on all cores
    elements: int = 0
    rays: int = 0


@dataclass(frozen=True)
class Plan:
    """What to run. ``budget`` [s]: no new bake is begun after that; the rest is named."""

    scenes: tuple[StudyScene, ...]
    errors: tuple[float, ...]
    seeds: tuple[int, ...]
    samples: tuple[int, ...]
    budget: float = float("inf")


def run_study(plan: Plan, say=print) -> list[Row]:
    """All rows of the plan; scenes whose files are missing, errors that the
    references cannot tell, and what is beyond the budget are named."""
    warm_up()
    start, rows = time.perf_counter(), []
    say(machine())
    for scene in plan.scenes:
        if time.perf_counter() - start > plan.budget:
            say(f"{scene.name}: left out, the budget of {plan.budget:.0f} s is spent")
            continue
        try:
            obj = build(scene)
        except SceneMissing as missing:
            say(f"{scene.name}: left out, {missing}")
            continue
        rows += _study_scene(scene, obj, plan, start, say)
    return rows


def _study_scene(scene: StudyScene, obj, plan: Plan, start: float, say) -> list[Row]:
    """Our bakes and the ladder of one scene."""
    comparable = comparable_texels(triangle_uvs(obj), scene.size)
    if scene.doubled:
        comparable &= ~doubled_texels(obj, scene.size)
    references, noise = _truth(scene, obj, comparable, say)
    comparable &= references.mask
    rows = []
    for error in plan.errors:
        if least_measurable(noise) > MEASURABLE * error:
            say(f"{scene.name}: error {error:g} left out, the references are too noisy")
            continue
        for seed in plan.seeds:
            if time.perf_counter() - start > plan.budget:
                say(f"{scene.name}: error {error:g}, seed {seed} left out, the budget is spent")
                continue
            rows.append(_our_row(scene, obj, error, seed, references, comparable))
            say(_line(rows[-1]))
    for rung in cycles_ladder(obj, scene.size, references, comparable, PASSES, plan.samples):
        count = float(rung.effort.split()[0])
        rows.append(Row(scene.name, rung.method, count, 0, rung.seconds, rung.error.error,
                        rung.error.uncertainty))  # fmt: skip
        say(_line(rows[-1]))
    return rows


def _truth(scene: StudyScene, obj, comparable, say) -> tuple[References, float]:
    """Two Cycles bakes, or the exact radiance twice; and how far each is off."""
    if scene.exact is not None:
        image = np.full((scene.size, scene.size, 3), scene.exact)
        say(f"{scene.name}: {comparable.sum()} texels compared with the exact solution")
        return References(image, image, comparable, 0.0), 0.0
    references = cycles_references(obj, scene.size, scene.reference, PASSES)
    both = comparable & references.mask
    noise = reference_noise(references.a[both], references.b[both])
    say(f"{scene.name}: {both.sum()} texels compared; references of {scene.reference} samples, "
        f"each {100 * noise:.2f} % off, {references.seconds:.0f} s")  # fmt: skip
    return references, noise


def _our_row(scene, obj, error, seed, references, comparable) -> Row:
    bake = our_bake(obj, scene.size, error, seed)
    measured = relative_error(
        bake.pixels[comparable], references.a[comparable], references.b[comparable]
    )
    figures = bake.statistics
    return Row(
        scene.name, "ours", error, seed, bake.seconds, measured.error, measured.uncertainty,
        figures.estimated_error, figures.seconds.get("embree", float("nan")) / thread_count(0),
        figures.elements, figures.rays,
    )  # fmt: skip


def _line(row: Row) -> str:
    tail = f", estimated {100 * row.estimated:.2f} %" if row.method == "ours" else ""
    error = Measured(row.measured, row.uncertainty)
    return (f"  {row.scene:<12} {row.method:<14} {row.asked:<6g} seed {row.seed}: "
            f"{row.seconds:7.2f} s, {error}{tail}")  # fmt: skip


def write_csv(rows: list[Row], path: Path) -> None:
    """One line a bake."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, [field.name for field in fields(Row)])
        table.writeheader()
        table.writerows(asdict(row) for row in rows)


def read_csv(path: Path) -> list[Row]:
    """What ``write_csv`` wrote."""
    kinds = {"scene": str, "method": str, "seed": int, "elements": int, "rays": int}
    with open(path, newline="", encoding="utf-8") as file:
        return [
            Row(**{name: kinds.get(name, float)(value) for name, value in line.items()})
            for line in csv.DictReader(file)
        ]


def _plan(chosen) -> Plan:
    names = chosen.scenes or (QUICK_SCENES if chosen.quick else tuple(SCENES))
    most = chosen.reference or max(SCENES[name].reference for name in names)
    scenes = tuple(replace(SCENES[n], reference=min(SCENES[n].reference, most)) for n in names)
    if chosen.quick:
        scenes = tuple(replace(s, size=QUICK_SIZE, reference=QUICK_REFERENCE) for s in scenes)
        chosen.errors, chosen.seeds, chosen.samples = QUICK.values()
    return Plan(scenes, tuple(chosen.errors), tuple(chosen.seeds), tuple(chosen.samples),
                chosen.budget)  # fmt: skip


def main(arguments=None) -> None:
    from .trade import summary, write_trade

    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.study",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--quick", action="store_true", help="two minutes: small, coarse, 3 scenes")
    parser.add_argument("--scenes", nargs="+", choices=list(SCENES))
    parser.add_argument("--errors", nargs="+", type=float, default=[0.1, 0.03, 0.01, 0.003])
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2, 3, 4])
    parser.add_argument("--samples", nargs="*", type=int, default=[4, 16, 64, 256])
    parser.add_argument("--reference", type=int, help="at most so many samples of a reference")
    parser.add_argument("--budget", type=float, default=float("inf"), help="seconds in all")
    parser.add_argument("--output", type=Path, default=DOCS, help="folder of trade.md")
    chosen = parser.parse_args(arguments)
    rows = run_study(_plan(chosen))
    write_csv(rows, chosen.output / "figures" / "study.csv")
    write_trade(rows, chosen.output, machine())
    print(summary(rows))


if __name__ == "__main__":
    main()
