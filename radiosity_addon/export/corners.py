"""Corner maps: colours at evaluated corners as weighted sums over the user's own loops.

Depends on NumPy and SciPy. Without modifiers that change faces the weights are one-hot.
"""

from __future__ import annotations

import numpy as np


def one_hot(loops: np.ndarray, n_loops: int):
    """(3 n, n_loops) csr_matrix from the loop at each triangle corner, (n, 3)."""
    from scipy.sparse import csr_matrix

    loops = loops.reshape(-1)
    return csr_matrix(
        (np.ones(len(loops)), loops, np.arange(len(loops) + 1)), shape=(len(loops), n_loops)
    )
