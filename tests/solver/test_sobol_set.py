"""Sobol sets: bit for bit SciPy's, wherever they begin."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import qmc

from radiosity_addon.solver.sampling.sobol_set import BITS, POLYNOMIALS, SobolSet


@pytest.mark.parametrize("dimensions", range(1, len(POLYNOMIALS) + 1))
def test_points_are_those_of_scipy(dimensions):
    """Its class takes another way: a matrix of direction numbers for all dimensions, in C."""
    for seed in range(4):
        theirs = qmc.Sobol(dimensions, rng=np.random.default_rng(seed)).random(1 << 12)
        ours = SobolSet(dimensions, np.random.default_rng(seed)).points(0, 1 << 12)
        np.testing.assert_array_equal(ours * 2.0**-BITS, theirs)


def test_points_go_on_from_any_number():
    found = SobolSet(5, np.random.default_rng(7))
    whole = found.points(0, 3000)
    parts = [found.points(first, count) for first, count in ((0, 1), (1, 1023), (1024, 1976))]
    np.testing.assert_array_equal(np.concatenate(parts), whole)


def test_more_dimensions_than_there_are_is_refused():
    with pytest.raises(ValueError, match="9 dimensions; there are 1 to 8"):
        SobolSet(9, np.random.default_rng(0))
