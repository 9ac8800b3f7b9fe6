"""Array structs: frozen dataclasses of arrays whose first axis numbers the same n things."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any, Self

import numpy as np

Column = Any  # an array, an ArrayStruct or None


class ArrayStruct:
    """Base of such a dataclass. A field may also be another of them, or None where there is none."""

    def take(self, index: np.ndarray | slice) -> Self:
        """The things with these numbers, or of which ``index`` (n,) bool is true."""
        values = (getattr(self, field.name) for field in fields(self))
        return type(self)(*(_taken(value, index) for value in values))

    @classmethod
    def join(cls, parts: Sequence[Self]) -> Self:
        """All things of all parts, of which there is at least one."""
        columns = ([getattr(part, field.name) for part in parts] for field in fields(cls))
        return cls(*map(_joined, columns))


def _taken(value: Column, index: np.ndarray | slice) -> Column:
    if value is None:
        return None
    return value[index] if isinstance(value, np.ndarray) else value.take(index)


def _joined(values: list[Column]) -> Column:
    first = values[0]
    if first is None:
        return None
    return np.concatenate(values) if isinstance(first, np.ndarray) else type(first).join(values)
