"""Streams: which random numbers belong to which stage, so that no two stages share any.

A key of random numbers begins with the seed and its stage's stream; what follows tells apart what
the stage draws (see ``sobol``). The numbers themselves mean nothing, but to change one changes
every bake's noise.
"""

from __future__ import annotations

from enum import IntEnum, unique


@unique
class Stream(IntEnum):
    """The second word of a key, after the seed."""

    SOLVE = 10  # points and rays of the elements' and patches' rows
    RESIDUAL = 11  # paths along the residual
    DIRECT = 20  # points of receivers for explicit light
    GATHER = 21  # points and rays of receivers
    RELIGHT = 40  # points of a kept solve that is lit anew
    FORM_FACTORS = 41  # of patches, apart from any bake
    EMISSIVE_FACES = 50  # probes of what their light may reach; alike for all seeds
    PARTICLE_BOUNCES = 61  # of the energy figures
    PARTICLES_OF_LIGHTS = 62
    PARTICLES_FROM_AFAR = 63
    BEAM_TRIALS = 64  # particles that find which spots are beams; alike for all seeds
    BEAMS = 65  # particles of a beam
    SIGNS = 70  # of differences, by which the error estimator tests what replicates share; alike for all
