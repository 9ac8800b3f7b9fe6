"""Late rows: light that rays bring from sides that had no row when the system was solved.

Elements are known where rays of a sample of the receivers met them, or rays of known ones. One of
later rays in a few hundred meets another, as in a pocket of its own: it gets a row then,
and the new rows alone are solved.
"""

from __future__ import annotations

from dataclasses import replace

from ..lights.context import Context
from ..transport.radiosity import Radiosity, extended
from .gather import Gathered, light_at


def with_late_rows(
    context: Context, radiosity: Radiosity, found: Gathered, key
) -> tuple[Gathered, Radiosity]:
    """What rays brought, and what is reflected from the ``unseen`` places that they met; with the
    radiosity of these, too."""
    unseen = found.unseen
    if len(unseen.owner) == 0:
        return found, radiosity
    radiosity = extended(context, radiosity, unseen.places, key)
    more = light_at(radiosity.reflected, unseen, len(found.bounced))
    return replace(found, bounced=found.bounced + more), radiosity
