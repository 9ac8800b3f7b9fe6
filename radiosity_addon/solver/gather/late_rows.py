"""Late rows: light from where gathered rays ended and nothing was known when the system was solved.

The linear system has rows for those patches that rays of a sample of the receivers met, and for those
that rays of these rows met. Of the rays that are gathered later, one in a few hundred ends on a patch
without a row, as in a pocket of its own: that patch gets a row then, and the new rows alone are solved.
Rays that end on no patch are followed further (``onward``).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..lights.context import Context
from ..transport.onward import FOLLOWED_PER_CHUNK, Ends, chunk_key, join_ends, own_numbers
from ..transport.radiosity import Radiosity
from ..transport.solve_patches import extended
from ..workers.parallel import ranges
from .gather import follow_onward, light_at

STAGE = "gather"


def light_of_unknown(
    context: Context, radiosity: Radiosity, unknown: Ends, count: int, key: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray, Radiosity]:
    """Light (count, channels) of owners' rays that ended where nothing is known: reflected, and
    first-hand; and the radiosity, with rows for what they met."""
    onward = unknown.places.entry == radiosity.patches.onward
    lost, late = unknown.take(onward), unknown.take(~onward)
    work = _FollowChunk(context, radiosity.table(), lost, key)
    chunks = ranges(len(lost.owner), FOLLOWED_PER_CHUNK)
    bounced, first = np.zeros((2, count, context.channels))
    ends = [late]
    for owners, *light, rest in context.map_chunks(work, chunks, STAGE):
        bounced[owners] += light[0]
        first[owners] += light[1]
        ends.append(rest)
    late = join_ends(ends, context.channels)
    if len(late.owner):
        radiosity = extended(context, radiosity, late.places, (*key, 3))
    return bounced + light_at(radiosity.reflected, late, count), first, radiosity


@dataclass(frozen=True)
class _FollowChunk:
    """Follows a slice of ``rays`` that ended on no patch: their owners (k,) int, the light that is reflected
    to these and that they see first-hand (k, channels), and the Ends of which nothing is known."""

    context: Context
    radiosity: Radiosity
    rays: Ends
    key: tuple[int, ...]

    def __call__(self, chunk: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray, Ends]:
        radiosity, (owners, rays) = self.radiosity, own_numbers(self.rays.take(chunk))
        key = chunk_key(self.key, chunk)
        light, first, ends = follow_onward(self.context, radiosity, rays, len(owners), key)
        unknown = radiosity.unknown[ends.places.entry]
        light += light_at(radiosity.reflected, ends.take(~unknown), len(owners))
        rest = ends.take(unknown)
        return owners, light, first, replace(rest, owner=owners[rest.owner])
