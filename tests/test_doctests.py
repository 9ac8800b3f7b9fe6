"""The examples in the docstrings of the three central calls, and of how numbers are written."""

from __future__ import annotations

import doctest

import pytest

from radiosity_addon import figures
from radiosity_addon.solver import sequence
from radiosity_addon.solver.transport import form_factors
from verification import second_kind_example


@pytest.mark.parametrize("module", [figures, sequence, form_factors, second_kind_example],
                         ids=lambda module: module.__name__)  # fmt: skip
def test_examples_are_true(module):
    found = doctest.testmod(module)
    assert found.attempted > 0 and found.failed == 0
