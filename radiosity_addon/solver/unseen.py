"""Unseen: light that rays bring from sides that nothing was known of when the system was solved.

Depends on ``context``, ``radiosity``, ``transport``, ``gather``. Elements are known where rays of a
sample of the receivers met them, or rays of known ones. One of later rays in a few hundred meets
another: what is lit there, and what comes there from known sides, is found out on the spot.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .context import Context
from .gather import Gathered, gather
from .points import points_on
from .radiosity import Radiosity
from .sampling import uniform
from .transport import light_points

RAYS = 4  # from a place that receivers' rays met; one from what those meet, and so on
DEPTH = 8  # unseen sides that are met one after the other


def with_unseen(
    context: Context, radiosity: Radiosity, found: Gathered, key, stage: str, depth: int = 0
) -> Gathered:
    """What rays brought, and what is reflected from the ``unseen`` places that they met."""
    unseen = found.unseen
    if unseen is None or depth == DEPTH:
        return found
    count = len(unseen.owner)
    turn, front = uniform((count, 3), *key, 7), (unseen.side & 1) == 0
    place = (array[None] for array in (unseen.triangle, unseen.u, unseen.v, front))
    points = points_on(context.geometry, *place, turn)
    reflectance, lit, _ = light_points(context, points, key)
    inner = gather(
        context, radiosity, count, 1 if depth else RAYS, lambda chosen, group: points.take(chosen),
        (*key, depth), stage, np.arange(count),
    )
    inner = with_unseen(context, radiosity, inner, (*key, depth), stage, depth + 1)
    light = unseen.weight * (lit + reflectance[0] * (inner.bounced + inner.first))
    more = [np.bincount(unseen.owner, column, len(found.bounced)) for column in light.T]
    return replace(found, bounced=found.bounced + np.stack(more, 1))
