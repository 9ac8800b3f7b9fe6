"""Passes: the parts of the light that a bake may hold; Cycles' meaning of the words."""

from __future__ import annotations

from enum import StrEnum


class Pass(StrEnum):
    """One part, equal to its word in settings."""

    EMIT = "emit"  # what surfaces send out by themselves
    DIRECT = "direct"  # irradiance from what emits
    INDIRECT = "indirect"  # irradiance from what reflects
    COLOR = "color"  # multiplied by the diffuse reflectance
