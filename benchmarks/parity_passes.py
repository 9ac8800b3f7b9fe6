"""Parity cases of passes: what each combination leaves in the bake."""

from __future__ import annotations

from functools import partial

from .parity_stage import Case, panel, stage
from .scene_parts import glowing, matte

BLACK, COLORED = (0.0, 0.0, 0.0), (0.7, 0.5, 0.2)


def scene(reflectance=COLORED):
    """The lit stage in a color; the slab red."""
    return stage(matte("Stage", reflectance), lit=True)


def glowing_scene():
    """The lit stage, itself reflecting and emitting."""
    return stage(glowing("Stage", 0.4, 0.5), lit=True)


def beside(reflectance):
    """A small sheet on the colored stage, which is baked. It hardly lights what lights it: from
    black to a reflectance of 0.2 our indirect light grows by 0.14 %."""
    scene()
    color = (reflectance,) * 3
    return panel("Sheet", [(0.9, -1.5, 0.01), (1.5, -1.5, 0.01), (1.5, -0.9, 0.01),
                           (0.9, -0.9, 0.01)], matte("Sheet", color))  # fmt: skip


# Without color Cycles bakes black where reflectance is 0; this is as dark as makes no difference.
DARK = partial(scene, (1e-4,) * 3)
CASES = (
    Case("direct", scene, ("direct",)),
    Case("indirect", scene, ("indirect",), effort=4),
    Case("direct, indirect", scene, ("direct", "indirect")),
    Case("direct, color", scene, ("direct", "color")),
    Case("indirect, color", scene, ("indirect", "color"), effort=4),
    Case("color", scene, ("color",)),
    Case("direct, reflectance 0", partial(scene, BLACK), ("direct",), stand_in=DARK),
    Case("indirect, reflectance 0.2", partial(scene, (0.2,) * 3), ("indirect",), effort=4),
    Case("indirect, reflectance 0", partial(beside, 0.0), ("indirect",),
         stand_in=partial(beside, 0.2), effort=4),
    Case("emit", glowing_scene, ("emit",)),
    Case("all, the stage glows", glowing_scene),
)
