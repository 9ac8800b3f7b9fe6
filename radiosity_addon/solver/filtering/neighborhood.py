"""Neighborhood: what smoothing asks of receivers that are neighbors of each other on the surface.

There are two kinds: the texels of an image (``lattice``) and receivers anywhere (``graph``). Values
at n receivers become pictures, of a shape of the neighborhood's own, which kernels of growing width
average; a *level* is one kernel.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np


class Sees(Protocol):
    """(k,) bool: whether receivers ``one`` (k,) int see all of receivers ``other`` (k,) int."""

    def __call__(self, one: np.ndarray, other: np.ndarray, /) -> np.ndarray: ...


class Neighborhood(Protocol):
    """n receivers, and who is whose neighbor."""

    @property
    def index(self) -> slice:
        """Which of all receivers the n are."""

    @property
    def levels(self) -> int:
        """How many kernels there are, each twice as wide as the one before."""

    def as_pictures(
        self, values: np.ndarray, chosen: list[int] | None = None, factor: float = 1.0
    ) -> np.ndarray:
        """(c, ...) float32 pictures of ``factor`` times the values (count, c) of all receivers, or
        of the ``chosen`` channels (c,) of them."""

    def read(self, picture: np.ndarray) -> np.ndarray:
        """(n,) values of the receivers in a picture (...)."""

    def step(
        self, *pictures: np.ndarray, level: int, into: list[np.ndarray] | None = None
    ) -> list[np.ndarray]:
        """One kernel applied to pictures (...). The results may be put ``into`` pictures that are 0
        wherever there is no receiver."""

    def variance_kept(self, level: int) -> float:
        """The share of independent noise's variance that kernels up to ``level`` leave."""

    def averaging_levels(self, level: int) -> int:
        """Levels of kernels that average what decides whether to go to ``level``."""

    def beside(self, picture: np.ndarray) -> np.ndarray:
        """Of a picture >= 0, one above 0 at the receivers that are or have a neighbor above 0."""

    def separated(self, dark: np.ndarray, sees: Sees) -> Neighborhood:
        """Without the links by which receivers that are ``dark`` (count,) bool would get light from
        others that are not and that they do not see."""
