"""The pipeline in three stages: prepare (Blender), run (anywhere), apply (Blender).

``run`` imports no bpy, and a Job and a Result can be pickled, so that the middle stage may live in
another process. ``discard`` takes back what ``prepare`` changed when the bake is given up.
"""

from .stages.apply import apply, find_encoding
from .stages.job import Job, Result
from .stages.leave_out import without_bare
from .stages.prepare import discard, prepare
from .stages.run import run

__all__ = ("Job", "Result", "apply", "discard", "find_encoding", "prepare", "run", "without_bare")
