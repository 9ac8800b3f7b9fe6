"""Walls: neighbors on the two sides of something that stands on their surface share no light.

Where triangles cross or stand on one another is known (``tracing.crossings``), so only receivers
near such a line are looked at: one that a line divides holds the light of both sides and is a
neighbor of its like only, and others are neighbors where a path above the surface is clear.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..direct.line_of_sight import is_path_clear
from ..geometry.footprints import Footprints
from ..geometry.vectors import unit_rows
from ..lights.context import Context
from ..receivers import Receivers
from ..tracing.contacts import find_contacts, shares_above

DIVIDED = 1e-3  # share [of a receiver] on either side of a line, at least, for the line to divide it


@dataclass(frozen=True)
class Walls:
    """Of receivers: ``near`` (count,) bool, a line touches them, and ``divided`` (count,) bool;
    ``crossed`` (count,) bool, lines run over one of their triangles."""

    context: Context
    position: np.ndarray  # (count, 3)
    normal: np.ndarray  # (count, 3) unit
    near: np.ndarray
    divided: np.ndarray
    crossed: np.ndarray

    def between(self, one: np.ndarray, other: np.ndarray) -> np.ndarray:
        """(k,) bool: something stands between receivers (k,) and (k,), near each other."""
        divided = self.divided[one], self.divided[other]
        separated = divided[0] != divided[1]
        some = np.flatnonzero(~(divided[0] | divided[1]))
        pairs = ((self.position[end[some]], self.normal[end[some]]) for end in (one, other))
        separated[some] = ~is_path_clear(self.context, *(array for pair in pairs for array in pair))
        return separated


def find_walls(context: Context, footprints: Footprints, receivers: Receivers) -> Walls | None:
    """None where nothing stands on anything."""
    crossings = context.crossings
    if len(crossings.triangle) == 0:
        return None
    position, normal = footprints.middle()
    normal = unit_rows(normal)
    contacts = find_contacts(crossings, receivers, context.threads)
    line, owner = contacts.line, receivers.receiver[contacts.cell]
    near, crossed = (np.zeros(receivers.count, bool) for _ in range(2))
    near[owner] = True
    crossed[receivers.receiver[np.isin(receivers.triangle, crossings.triangle)]] = True
    line, owner = np.unique(np.stack([line, owner]), axis=1)
    divided = np.zeros(receivers.count, bool)
    divided[owner[_divides(context, footprints, receivers, line, owner)]] = True
    return Walls(context, position, normal, near, divided, crossed)


def _divides(
    context: Context, footprints: Footprints, receivers: Receivers, line: np.ndarray,
    owner: np.ndarray,
) -> np.ndarray:
    """(k,) bool: whether parts of the receivers ``owner`` (k,) lie on both sides of lines (k,)."""
    pair, cell = footprints.cells_of(owner)
    above = shares_above(context.geometry, context.crossings, receivers, line[pair], cell)
    area = np.diff(footprints.cumulative)[cell]
    total = np.bincount(pair, area, len(owner))
    above = np.bincount(pair, area * above, len(owner)) / np.maximum(total, 1e-300)
    return (above > DIVIDED) & (above < 1 - DIVIDED)
