"""Darkness: whether a bake has light, and enough of it to be seen. No bpy."""

from __future__ import annotations

import numpy as np

from ..figures import figure
from ..solver.passes import Pass
from ..solver.solution import Solution

DIM = 0.1  # brightness [of white on a screen]: a bake that has less everywhere is too dark to be seen well


def brightest(solution: Solution) -> float:
    """The largest radiance, mean over channels, that any receiver would have if it were white: its emission, and the light
    that arrives there."""
    light = solution.emission + (solution.direct + solution.indirect) / np.pi
    return float(light.mean(axis=1).max(initial=0.0))


def warn_of_darkness(passes: tuple[Pass, ...], most: float) -> list[str]:
    """A warning where ``most``, the light of the ``brightest`` receiver, is nothing, or little although all light was
    asked for by the ``passes``."""
    asked = {Pass.DIRECT, Pass.INDIRECT} & set(passes)
    if asked and most == 0:
        return ["nothing that is baked receives light: the result is black; add a lamp or a sky"]
    if not asked and Pass.EMIT in passes and most == 0:
        return ["nothing that is baked glows: the result is black; add the direct or the indirect pass for light"]
    if len(asked) == 2 and most < DIM:
        return [
            f"the scene is dark: at its brightest place, a white surface would have the value {figure(most, 1)}, where 1 is "
            "white on the screen; add light, or raise the exposure (Render Properties > Color Management)"
        ]
    return []
