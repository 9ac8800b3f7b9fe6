"""Connected components, against SciPy's and against components known beforehand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components as scipys

from radiosity_addon.components import connected_components


@pytest.mark.parametrize("edges", [0, 1, 300, 700, 5000])
def test_random_graphs(edges):
    """Below, at and above the number of edges where a giant component appears (n / 2)."""
    first, second = np.random.default_rng(edges).integers(0, 1000, (2, edges))
    graph = coo_matrix((np.ones(edges), (first, second)), shape=(1000, 1000))
    expected = scipys(graph, directed=False)[1]
    assert np.array_equal(connected_components(1000, first, second), expected)


def test_a_long_chain_in_any_order():
    order = np.random.default_rng(0).permutation(100_000)
    assert not connected_components(100_000, order[:-1], order[1:]).any()


def test_no_nodes():
    nothing = np.zeros(0, np.int64)
    assert len(connected_components(0, nothing, nothing)) == 0
