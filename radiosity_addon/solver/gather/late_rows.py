"""Late rows: light from where gathered rays ended and nothing was known when the system was solved.

Rays of a few places go on. Patches are known where rays of a sample of the receivers met them, or
rays of known ones. One of later rays in a few hundred meets another, as in a pocket of its own: it
gets a row then, and the new rows alone are solved.
"""

from __future__ import annotations

import numpy as np

from ..lights.context import Context
from ..transport.onward import Ends, join_ends
from ..transport.radiosity import Radiosity
from ..transport.solve_patches import extended
from .gather import follow_onward, light_at


def light_of_unknown(
    context: Context, radiosity: Radiosity, unknown: Ends, count: int, key: tuple[int, ...]
):
    """Light (count, channels) of owners' rays that ended where nothing is known: reflected, and
    first-hand; and the radiosity, with rows for what they met."""
    onward = unknown.places.entry == radiosity.patches.onward
    lost, late = np.flatnonzero(onward), np.flatnonzero(~onward)
    bounced, first, ends = follow_onward(context, radiosity, unknown.take(lost), count, key)
    ends = join_ends([unknown.take(late), ends], context.channels)
    unknown = np.flatnonzero(radiosity.unknown[ends.places.entry])
    if len(unknown):
        radiosity = extended(context, radiosity, ends.places.take(unknown), (*key, 3))
    return bounced + light_at(radiosity.reflected, ends, count), first, radiosity
