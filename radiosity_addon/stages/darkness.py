"""Darkness: whether a bake has light, and enough of it to be seen. No bpy."""

from __future__ import annotations

import numpy as np

from ..figures import figure
from ..solver.passes import Pass
from ..solver.solution import Solution

DIM = 0.1  # brightness [of white on a screen]: of a bake that has less everywhere little is seen


def brightest(solution: Solution) -> float:
    """The most that a receiver shows: what it gives itself, and what of the light there white would
    reflect; the mean over channels."""
    light = solution.emission + (solution.direct + solution.indirect) / np.pi
    return float(light.mean(axis=1).max(initial=0.0))


def warn_of_darkness(passes: tuple[Pass, ...], most: float) -> list[str]:
    """Where the ``brightest`` receiver shows nothing, or little of all light: only what the passes
    ask for was looked for."""
    asked = {Pass.DIRECT, Pass.INDIRECT} & set(passes)
    if asked and most == 0:
        return ["nothing that is baked receives light: the result is black; add a lamp or a sky"]
    if len(asked) == 2 and most < DIM:
        return [
            f"little light arrives: white would show {figure(most, 1)} where there is most of it, and 1 is "
            "white on the screen; add light, or raise the exposure (Render Properties > Color Management)"
        ]
    return []
