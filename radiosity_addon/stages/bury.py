"""Bury: leave out what nobody sees of the receivers, inside solids, flush against them or hidden in gaps. No bpy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..bake.faces import receiver_areas
from ..solver.lights.context import Context
from ..solver.receivers import Receivers, chosen_receivers, concatenate
from ..solver.scene import Scene
from ..solver.tracing.buried import FULLY_OPEN, Surroundings, find_surroundings, without_buried
from ..solver.transport.free_paths import find_free_paths
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
    return replace(_without(layout, kept, buried), cut=less[~buried])


def seen_layout(layout: Layout, context: Context) -> tuple[Layout, np.ndarray]:
    """The layout without the receivers that are hidden, which count as buried, and the mean free paths (count,) [unit box] of
    those left, which tell how much of them is seen for their area. Where all are hidden, the layout stays as it is."""
    paths = find_free_paths(context, layout.receivers)
    hidden = paths.hidden & ~paths.hidden.all()
    return _without(layout, layout.receivers, hidden), paths.mean[~hidden]


def _without(layout: Layout, receivers: Receivers, buried: np.ndarray) -> Layout:
    """The ``layout`` with ``receivers``, as many, each with what is open of its own, without those that are ``buried`` (count,) bool:
    these join its ``buried``."""
    spans = np.concatenate([[0], np.cumsum(~buried)])[list(layout.spans)]
    more = chosen_receivers(layout.receivers, buried)
    return replace(
        layout, receivers=chosen_receivers(receivers, ~buried), spans=tuple(spans.tolist()),
        cut=None if layout.cut is None else layout.cut[~buried],
        buried=more if layout.buried is None else concatenate([layout.buried, more]),
    )  # fmt: skip


def _areas(scene: Scene, receivers: Receivers) -> np.ndarray:
    return receiver_areas(scene.vertices, scene.triangles, receivers)
