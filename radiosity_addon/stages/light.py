"""Light: whether a bake has any. No bpy."""

from __future__ import annotations

from ..solver.passes import Pass
from ..solver.solution import Solution


def has_light(solution: Solution) -> bool:
    """Whether any receiver has light of its own or from elsewhere."""
    return any(part.any() for part in (solution.emission, solution.direct, solution.indirect))


def warn_of_darkness(passes: tuple[Pass, ...]) -> list[str]:
    """Where there is no light: only what the passes ask for was looked for."""
    if not {Pass.DIRECT, Pass.INDIRECT} & set(passes):
        return []
    return ["nothing that is baked receives light: the result is black; add a lamp or a sky"]
