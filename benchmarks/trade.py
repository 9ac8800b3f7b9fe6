"""The trade of speed for accuracy as a page: figures, table, plots (with matplotlib). NumPy."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np

from verification.error import Measured

from .ladder import Rung, seconds_for

RIVALS = ("Cycles", "Cycles + OIDN")
NEXT_TO_NONE = 0.01  # of the asked error: what is below is as good as exact
COLORS = {"ours": "tab:blue", "Cycles": "tab:red", "Cycles + OIDN": "tab:orange"}


def summary(rows) -> str:
    """The figures the project holds itself to, as markdown bullets."""
    ours = [row for row in rows if row.method == "ours"]
    if not ours:
        return "* nothing baked"
    kept = np.mean([row.measured <= row.asked for row in ours])
    honest = np.mean([_honest(row) for row in ours])
    lines = [f"* measured error ≤ asked error in {100 * kept:.0f} % of {len(ours)} bakes",
             f"* estimated / measured between 0.5 and 2 in {100 * honest:.0f} % (bakes in which "
             "both are below a hundredth of the asked error count as such)"]  # fmt: skip
    for rival in RIVALS:
        for asked in (0.03, 0.01):
            gains = speedups(rows, rival, asked)
            finite = [gain for gain in gains.values() if np.isfinite(gain)]
            if finite:
                mean = np.exp(np.mean(np.log(finite)))
                each = ", ".join(f"{scene} {gain:.1f}" for scene, gain in gains.items())
                lines.append(f"* at an asked {100 * asked:g} %: {mean:.1f} × faster than {rival} at "
                             f"the error reached (geometric mean of {len(finite)} scenes: "
                             f"{each})")  # fmt: skip
    shares = [row.seconds / row.embree_seconds for row in ours if row.embree_seconds > 0]
    if shares:
        lines.append("* whole bake over the time Embree alone takes for the same rays on the same "
                     f"cores: median {np.median(shares):.1f}")  # fmt: skip
    for scene, slope in time_slopes(ours).items():
        lines.append(f"* {scene}: time grows as error^−{slope:.2f} between 3 % and 0.3 %")
    return "\n".join(lines)


def _honest(row) -> bool:
    """The estimate is within a factor of two, or right that there is hardly any error."""
    if max(row.estimated, row.measured) < NEXT_TO_NONE * row.asked:
        return True
    return 0.5 * row.measured <= row.estimated <= 2 * row.measured


def speedups(rows, rival: str, asked: float = 0.03) -> dict[str, float]:
    """Per scene: the rival's time for the error that we reached when asked, over our time.

    Where we were far better than asked (a furnace comes out exact) a third of the asked error
    counts: nobody asked for more.
    """
    gains = {}
    for scene in dict.fromkeys(row.scene for row in rows):
        rungs = [Rung(row.method, "", row.seconds, Measured(row.measured, row.uncertainty))
                 for row in rows if row.scene == scene and row.method == rival]  # fmt: skip
        mine = [row for row in rows if (row.scene, row.method, row.asked) == (scene, "ours", asked)]
        if rungs and mine:
            error = float(np.sqrt(np.mean([row.measured**2 for row in mine])))
            seconds = float(np.mean([row.seconds for row in mine]))
            gains[scene] = seconds_for(max(error, asked / 3), rungs, rival) / seconds
    return gains


def time_slopes(ours) -> dict[str, float]:
    """Per scene with three errors or more: slope of log time against −log measured error."""
    slopes = {}
    for scene in dict.fromkeys(row.scene for row in ours):
        mine = [row for row in ours if row.scene == scene]
        fine = [row for row in mine if row.asked <= 0.031]
        fine = [row for row in fine if row.measured > NEXT_TO_NONE * row.asked]
        if len({row.asked for row in fine}) >= 3:
            x, y = np.log([(row.measured, row.seconds) for row in fine]).T
            slopes[scene] = -float(np.polyfit(x, y, 1)[0])
    return slopes


def table(rows) -> str:
    """Markdown: one line per scene, method and effort, means over seeds."""
    head = ("scene", "method", "asked", "seconds", "measured", "estimated", "elements", "M rays")
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for key in dict.fromkeys((row.scene, row.method, row.asked) for row in rows):
        some = [row for row in rows if (row.scene, row.method, row.asked) == key]
        scene, method, asked = key
        measured = np.sqrt(np.mean([row.measured**2 for row in some]))
        mean = {n: np.mean([getattr(row, n) for row in some])
                for n in ("seconds", "estimated", "elements", "rays")}  # fmt: skip
        mine = method == "ours"
        effort = f"{100 * asked:g} %" if mine else f"{asked:.0f} samples"
        estimated = f"{100 * mean['estimated']:.2f} %"
        effort_in = f"{mean['elements']:.0f} | {mean['rays'] / 1e6:.1f}"
        own = f"{estimated} | {effort_in}" if mine else " | | "
        lines.append(f"| {scene} | {method} | {effort} | {mean['seconds']:.2f} | "
                     f"{100 * measured:.2f} % | {own} |")  # fmt: skip
    return "\n".join(lines)


def write_trade(rows, folder: Path, machine: str) -> Path:
    """``trade.md`` in the folder, with plots where matplotlib is installed; its path."""
    folder.mkdir(parents=True, exist_ok=True)
    parts = ["# The trade of speed for accuracy",
             f"Measured on: {machine}. Made by `python -m benchmarks.study`; error as defined in "
             "[theory](theory.md), against two independent Cycles references or the exact "
             "solution. Our seconds are of the whole bake; Cycles' of its bake operator alone.",
             summary(rows)]  # fmt: skip
    if importlib.util.find_spec("matplotlib"):
        (folder / "figures").mkdir(exist_ok=True)
        plot_trade(rows, folder / "figures" / "trade.png")
        plot_estimate(rows, folder / "figures" / "estimate.png")
        parts += ["![Relative error against seconds, one panel a scene, both axes logarithmic: "
                  "ours, Cycles and denoised Cycles](figures/trade.png)",
                  "![Estimated against measured error of our bakes; the band is a factor of two"
                  "](figures/estimate.png)"]  # fmt: skip
    parts.append(table(rows))
    path = folder / "trade.md"
    path.write_text("\n\n".join(parts) + "\n", encoding="utf-8")
    return path


def plot_trade(rows, path: Path) -> None:
    """Error against time, one panel a scene."""
    pyplot = _pyplot()
    scenes = list(dict.fromkeys(row.scene for row in rows))
    columns = min(4, len(scenes))
    lines = -(-len(scenes) // columns)
    figure, axes = pyplot.subplots(lines, columns, figsize=(3.6 * columns, 3.2 * lines),
                                   squeeze=False, layout="constrained")  # fmt: skip
    for panel in axes.flat[len(scenes) :]:
        panel.axis("off")
    for panel, scene in zip(axes.flat, scenes):
        for method, color in COLORS.items():
            some = [(r.seconds, r.measured) for r in rows if (r.scene, r.method) == (scene, method)]
            if some:
                style = "o" if method == "ours" else "s-"
                panel.loglog(*np.array(sorted(some)).T, style, color=color, ms=4, label=method)
        panel.set(title=scene, xlabel="seconds", ylabel="relative error")
        panel.grid(True, which="both", alpha=0.25)
    axes.flat[0].legend(fontsize=8)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def plot_estimate(rows, path: Path) -> None:
    """Estimated against measured error, with the band between a half and twice."""
    pyplot = _pyplot()
    figure, panel = pyplot.subplots(figsize=(4.5, 4.2), layout="constrained")
    for scene in dict.fromkeys(row.scene for row in rows):
        some = [(r.measured, r.estimated) for r in rows if (r.scene, r.method) == (scene, "ours")]
        if some:
            panel.loglog(*np.array(some).T, "o", ms=4, label=scene)
    line = np.array([1e-3, 0.3])
    panel.plot(line, line, "k-", lw=1)
    panel.fill_between(line, line / 2, line * 2, color="k", alpha=0.08)
    panel.set(xlabel="measured relative error", ylabel="estimated")
    panel.legend(fontsize=8)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def _pyplot():
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    return pyplot
