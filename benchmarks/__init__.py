"""The measured trade: our error and time beside Cycles and beside exact solutions.

Run from the project's folder: ``python -m benchmarks.cornell``, ``python -m benchmarks.study``.
"""

import os

from radiosity_addon.solver.workers.parallel import BLAS_ENVIRONMENT

os.environ.update(BLAS_ENVIRONMENT)
