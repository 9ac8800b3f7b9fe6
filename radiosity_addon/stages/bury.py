"""Bury: leave out what nobody sees of the receivers, inside solids or flush against them. No bpy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..bake.faces import receiver_areas
from ..solver.lights.context import Context
from ..solver.receivers import Receivers
from ..solver.scene import Scene
from ..solver.tracing.buried import FULLY_OPEN, Surroundings, find_surroundings, without_buried
from .layout import Layout


def open_layout(layout: Layout, context: Context) -> Layout:
    """The receivers' open parts. Those that are wholly buried are named as ``buried``; where
    nothing would be left, all stay."""
    opened = open_part(layout, context, surroundings_of(context))
    return opened if opened.receivers.count else layout


def surroundings_of(context: Context) -> Surroundings | None:
    """What may bury receivers; None where nothing does."""
    scene = context.scene
    opaque = ~context.transmits
    for objects in (scene.casts_shadow, scene.visible):
        if objects is not None:
            opaque &= objects[scene.object]
    return find_surroundings(scene, context.geometry, opaque, context.threads)


def open_part(layout: Layout, context: Context, surroundings: Surroundings | None) -> Layout:
    """The open parts of a layout's receivers, of which nothing may be left."""
    receivers = layout.receivers
    if surroundings is None or receivers.count == 0:
        return layout
    kept, buried = without_buried(surroundings, context.crossings, receivers)
    less = _areas(context.scene, kept) < FULLY_OPEN * _areas(context.scene, receivers)
    spans = np.concatenate([[0], np.cumsum(~buried)])[list(layout.spans)]
    return replace(
        layout, receivers=_some(kept, ~buried), spans=tuple(spans.tolist()),
        buried=_some(receivers, buried), cut=less[~buried],
    )  # fmt: skip


def _areas(scene: Scene, receivers: Receivers) -> np.ndarray:
    return receiver_areas(scene.vertices, scene.triangles, receivers)


def _some(receivers: Receivers, chosen: np.ndarray) -> Receivers:
    """Those ``chosen`` (count,) bool, numbered anew."""
    cells = chosen[receivers.receiver]
    number = np.cumsum(chosen, dtype=np.int32) - np.int32(1)
    return Receivers(
        count=int(chosen.sum()),
        receiver=number[receivers.receiver[cells]],
        triangle=receivers.triangle[cells],
        corners=receivers.corners[cells],
        square=receivers.square[cells],
        grid=None if receivers.grid is None else receivers.grid[chosen],
        maps=receivers.maps,
    )
