"""Work cut into steps: generators that yield the fraction done and return their result.

Blender's window answers between two steps, so whoever writes one keeps each piece short, holds no
bpy object across a ``yield`` (an undo would free it), and leaves the file unchanged there.
"""

from __future__ import annotations

from typing import Callable, Generator


def finish(steps: Generator, progress: Callable[[float], None] = lambda fraction: None):
    """Take all steps and return the result. ``progress`` is called with each fraction; it may raise."""
    while True:
        try:
            fraction = next(steps)
        except StopIteration as end:
            return end.value
        progress(fraction)


def scaled(low: float, high: float, steps: Generator):
    """The same steps as a part of others: their 0 to 1 is ``low`` to ``high``."""
    while True:
        try:
            fraction = next(steps)
        except StopIteration as end:
            return end.value
        yield low + (high - low) * fraction
