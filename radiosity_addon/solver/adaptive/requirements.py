"""Requirements: which light a bake has to find. The rest costs neither rays nor unknowns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from ..fields import is_black
from ..lights.context import Context
from ..passes import Pass
from ..scene import used_sides


class SolverSettings(Protocol):
    """What of the user's settings the solver looks at."""

    @property
    def passes(self) -> tuple[Pass, ...]:
        """Some of the words of ``Pass``."""

    @property
    def target_error(self) -> float:
        """Relative, local and over the surface."""

    @property
    def time_limit(self) -> float | None:
        """Seconds of solving; None: no limit."""

    @property
    def seed(self) -> int:
        """Of all random numbers."""

    @property
    def threads(self) -> int:
        """Of all processes together; 0: all cores."""


@dataclass(frozen=True)
class Requirements:
    """Light that is baked straight from its sources, ``direct``; light that rays meet ``first``-hand, from the sky and from
    what glows; and light that was ``reflected`` on its way. Reflected light is found by all light of the receivers that
    reflect it, whether that is baked or not."""

    direct: bool
    first: bool
    reflected: bool

    @property
    def explicit(self) -> bool:
        """Whether receivers need the light of sources that are sampled explicitly."""
        return self.direct or self.reflected

    @property
    def rays(self) -> bool:
        """Whether receivers need any."""
        return self.first or self.reflected


def requirements_of(context: Context, passes: tuple[Pass, ...]) -> Requirements:
    """What the ``passes`` ask for and the scene can give."""
    reflects = not all(is_black(side.reflectance) for side in used_sides(context.scene))
    found_by_rays = context.glows or context.sky is not None
    lit = found_by_rays or context.sources.count > 0
    direct, reflected = Pass.DIRECT in passes, Pass.INDIRECT in passes and reflects and lit
    return Requirements(direct, (direct or reflected) and found_by_rays, reflected)
