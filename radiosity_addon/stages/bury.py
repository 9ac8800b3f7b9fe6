"""Bury: leave out what nobody sees of the receivers, inside solids or flush against them. No bpy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..bake.faces import receiver_areas
from ..solver.lights.context import Context
from ..solver.receivers import Receivers, chosen_receivers
from ..solver.scene import Scene
from ..solver.tracing.buried import FULLY_OPEN, Surroundings, find_surroundings, without_buried
from .layout import Layout


def open_layout(layout: Layout, context: Context) -> Layout:
    """The layout of the parts of receivers that are not buried. Receivers that are wholly buried are listed as its
    ``buried``. Where all are buried, the layout stays as it is."""
    opened = open_part(layout, context, surroundings_of(context))
    return opened if opened.receivers.count else layout


def surroundings_of(context: Context) -> Surroundings | None:
    """What can bury receivers; None where nothing can."""
    scene = context.scene
    opaque = ~context.transmits
    for objects in (scene.casts_shadow, scene.visible):
        if objects is not None:
            opaque &= objects[scene.object]
    return find_surroundings(scene, context.geometry, opaque, context.threads)


def open_part(layout: Layout, context: Context, surroundings: Surroundings | None) -> Layout:
    """The layout of the parts of receivers that are not buried; it may be empty."""
    receivers = layout.receivers
    if surroundings is None or receivers.count == 0:
        return layout
    kept, buried = without_buried(surroundings, context.crossings, receivers)
    less = _areas(context.scene, kept) < FULLY_OPEN * _areas(context.scene, receivers)
    spans = np.concatenate([[0], np.cumsum(~buried)])[list(layout.spans)]
    return replace(
        layout, receivers=chosen_receivers(kept, ~buried), spans=tuple(spans.tolist()),
        buried=chosen_receivers(receivers, buried), cut=less[~buried],
    )  # fmt: skip


def _areas(scene: Scene, receivers: Receivers) -> np.ndarray:
    return receiver_areas(scene.vertices, scene.triangles, receivers)
