"""What ends a bake through no fault of this program; whatever else is raised is one, and reported as that."""

from __future__ import annotations


class Refused(ValueError):
    """What is asked for cannot be done, for what is in the scene, the settings or Blender: the message says what,
    and what to do."""


class ProcessLost(RuntimeError):
    """A process beside this one has ended; the message says how and what to do."""


EXPECTED = (Refused, ProcessLost, OSError, MemoryError, ImportError)
