"""Placed receivers: receivers in one scene, and what is known of them before any light is."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..filtering.walls import Walls, find_walls
from ..geometry.footprints import Footprints, build_footprints
from ..lights.context import Context
from ..materials.region_means import footprint_means
from ..receivers import Receivers
from ..sampling.guide import clusters_of
from ..transport.receiver_patches import ReceiverPatches, build_receiver_patches, squares_of_texels
from .correction import regions_of, usable_levels


@dataclass(frozen=True)
class PlacedReceivers:
    """``tile`` > 0 numbers the receivers where these come tile by tile: each tile has random numbers of
    its own. What is asked for is found once."""

    context: Context
    receivers: Receivers
    footprints: Footprints
    tile: int = 0

    @property
    def count(self) -> int:
        """Of receivers."""
        return self.footprints.count

    @cached_property
    def walls(self) -> Walls | None:
        """What stands on the receivers."""
        return find_walls(self.context, self.footprints, self.receivers)

    @cached_property
    def clusters(self) -> np.ndarray:
        """(count,) of receivers that learn together."""
        return clusters_of(*self.footprints.middle(), self.footprints.area)

    def regions(self, paths: int) -> list[np.ndarray]:
        """(count,) int each: regions that corrections are found for by so many ``paths``, coarse to fine."""
        return usable_levels(self._regions, paths)

    @cached_property
    def _regions(self) -> list[np.ndarray]:
        return regions_of(self.footprints)

    @property
    def reflectance(self) -> np.ndarray:
        """(count, channels) mean over each receiver."""
        return self._reflectances[:, : self.context.channels]

    @property
    def diffuse(self) -> np.ndarray:
        """(count, channels) mean of the diffuse reflectance over each receiver."""
        return self._reflectances[:, self.context.channels :]

    @cached_property
    def _reflectances(self) -> np.ndarray:
        return footprint_means(self.context.mean_reflectances, self.footprints)

    def patches(self, elements: int) -> ReceiverPatches | None:
        """Patches made of those receivers that are no larger than elements would be if the whole surface
        were divided into ``elements`` of them."""
        geometry, walls = self.context.geometry, self.walls
        return build_receiver_patches(
            self.receivers, self.footprints, self.context.scene.object,
            geometry.area, geometry.area.sum() / elements,
            None if walls is None else walls.divided,
            squares_of_texels(self.receivers, None if walls is None else walls.near),
        )


def placed(context: Context, receivers: Receivers, tile: int = 0) -> PlacedReceivers:
    """The receivers in the scene of a context."""
    return PlacedReceivers(context, receivers, build_footprints(context.geometry, receivers), tile)
