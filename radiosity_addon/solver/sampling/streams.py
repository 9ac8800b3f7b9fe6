"""Streams: random numbers by what they are drawn for, so that no two parts of the solver share any.

A key of random numbers begins with the seed and a stream; the words after these distinguish the draws within the
stream (see ``sobol``). The values below mean nothing, but to change one changes the noise of every bake.
"""

from __future__ import annotations

from enum import IntEnum, unique


@unique
class Stream(IntEnum):
    """What random numbers are drawn for: the second word of a key, after the seed."""

    SOLVE = 10  # points and rays of the elements' and patches' rows
    RESIDUAL = 11  # paths along the residual
    DIRECT = 20  # points of receivers for explicit light
    GATHER = 21  # points and rays of receivers
    RELIGHT = 40  # points of a cached solve that is lit anew
    FORM_FACTORS = 41  # of patches, apart from any bake
    EMISSIVE_FACES = 50  # probes of what their light may reach; alike for all seeds
    PARTICLE_BOUNCES = 61  # of the energy figures
    PARTICLES_OF_LIGHTS = 62
    PARTICLES_FROM_AFAR = 63
    BEAM_TRIALS = 64  # particles that find which spots are beams; alike for all seeds
    BEAMS = 65  # particles of a beam
    REFLECTORS = 66  # points of bright patches
    FREE_PATHS = 67  # rays that find how much is seen of receivers; alike for all seeds
    SIGNS = 70  # of differences, by which the error estimator tests what replicates share; alike for all seeds
