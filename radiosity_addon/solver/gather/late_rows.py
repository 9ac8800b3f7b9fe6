"""Late rows: light from where gathered rays ended and nothing was known when the system was solved.

The linear system has rows for those patches that rays of a sample of the receivers met, and for those
that rays of these rows met. Of the rays that are gathered later, one in a few hundred ends on a patch
without a row, as in a pocket of its own: that patch gets a row then, and the new rows alone are solved.
Of the rays that end on no patch some are followed further (``onward``).
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from ..lights.context import Context
from ..transport.onward import Ends, follow_in_chunks, join_ends, thinned
from ..transport.radiosity import Radiosity
from ..transport.solve_patches import extended
from .gather import follow_onward, light_at

# Share [of a receiver's rays that ended on no patch] that are followed, for all of them: one of these takes as long as
# twenty of the others. Measured: square of the error times time, of the kitchen, with all of them 1.3, half 1.2, a third 1.
FOLLOWED = 1 / 3
PHASE = "gather"


def light_of_unknown(
    context: Context, radiosity: Radiosity, unknown: Ends, count: int, key: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray, Radiosity]:
    """Light that owners' rays bring from where they ended and nothing was known: reflected and first-hand, (count,
    channels) each; and the radiosity, now with rows for what these rays met."""
    onward = unknown.places.entry == radiosity.patches.onward
    follow = partial(_follow, context, radiosity.table())
    bounced, first = np.zeros((2, count, context.channels))
    ends = [unknown.take(~onward)]
    rays = thinned(unknown.take(onward), FOLLOWED, (*key, 4))
    for owners, found in follow_in_chunks(context, follow, rays, key, PHASE):
        light, first_hand, rest = found
        bounced[owners] += light
        first[owners] += first_hand
        ends.append(replace(rest, owner=owners[rest.owner]))
    late = join_ends(ends, context.channels)
    if len(late.owner):
        radiosity = extended(context, radiosity, late.places, (*key, 3))
    return bounced + light_at(radiosity.reflected, late, count), first, radiosity


def _follow(
    context: Context, radiosity: Radiosity, rays: Ends, count: int, key: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray, Ends]:
    """What owners' ``rays`` that ended on no patch bring when they are followed further: reflected and first-hand
    light, (count, channels) each, and the Ends of which nothing is known."""
    light, first, ends = follow_onward(context, radiosity, rays, count, key)
    unknown = radiosity.unknown[ends.places.entry]
    light += light_at(radiosity.reflected, ends.take(~unknown), count)
    return light, first, ends.take(unknown)
