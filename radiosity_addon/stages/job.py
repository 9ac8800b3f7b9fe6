"""Job and Result: what passes between the stages. No bpy; both can be pickled.

Between the stages Blender's objects are known by their names only.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..bake.exported_object import ExportedObject
from ..bake.uv_maps import HeldMap
from ..settings import Settings
from ..solver.scene import Scene
from ..solver.solution import Statistics


@dataclass(frozen=True)
class UnbakedTexels:
    """What an atlas' image holds of objects that are not baked now."""

    pixels: np.ndarray  # (height, width, 4) float32
    objects: tuple[str, ...]


@dataclass(frozen=True)
class Job:
    """All that ``run`` needs, and the names that ``apply`` writes to."""

    settings: Settings
    scene: Scene
    targets: tuple[ExportedObject, ...]
    skipped: tuple[tuple[str, str], ...]  # (object name, reason)
    made_uv_maps: tuple[tuple[str, str], ...]  # (object name, UV map) that prepare added
    warnings: tuple[str, ...]
    replaced_uv_maps: tuple[HeldMap, ...] = ()  # what maps held before prepare laid them out anew
    unbaked: dict[str, UnbakedTexels] = field(default_factory=dict)  # by the name of the sheet


@dataclass(frozen=True)
class Result:
    """The colors, and the solver's figures.

    Vertex target: one array per target, (n_loops, 3) or (n_vertices, 3) float64. Image: one per
    sheet (see ``sheets_of``), (height, width, 4) float32.
    """

    colors: tuple[np.ndarray, ...]
    statistics: Statistics
    warnings: tuple[str, ...]
    seconds: dict = field(default_factory=dict)  # "fit": from light to colors
    receivers: int = 0  # how many places got light
    bare: tuple[int, ...] = ()  # numbers of the targets without a texel
