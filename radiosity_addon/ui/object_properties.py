"""What the panel asks of single objects. It is kept in custom properties, which a command line and
scripts read too."""

from __future__ import annotations

import bpy
from bpy.props import FloatProperty, IntVectorProperty

from ..bake.windows import DENSITY, RESOLUTION, density_factor, own_size
from ..settings import RESOLUTION_RANGE


def _get_resolution(item) -> tuple[int, int]:
    """The object's custom property, which a command line reads too; (0, 0) without a sound one."""
    try:
        return own_size(item, (0, 0))
    except ValueError:
        return 0, 0


def _set_resolution(item, value) -> None:
    width, height = value
    if width or height:  # one that is not named is as the other
        item[RESOLUTION] = [max(4, width or height), max(4, height or width)]
    elif RESOLUTION in item:
        del item[RESOLUTION]


def _get_density(item) -> float:
    try:
        return density_factor(item)
    except ValueError:
        return 1.0


def _set_density(item, value: float) -> None:
    if value != 1.0:
        item[DENSITY] = value
    elif DENSITY in item:
        del item[DENSITY]


def register_object_properties() -> None:
    bpy.types.Object.radiosity_own_resolution = IntVectorProperty(
        name="Own Resolution",
        description="Width and height of this object's own image; 0: as all others",
        size=2,
        get=_get_resolution,
        set=_set_resolution,
        min=0,
        max=RESOLUTION_RANGE[1],
    )
    bpy.types.Object.radiosity_density_factor = FloatProperty(
        name="Density Factor",
        description="How much denser this object's texels are in the atlas than others'",
        get=_get_density,
        set=_set_density,
        min=1e-3,
        max=1e3,
        soft_min=0.1,
        soft_max=10,
    )


def unregister_object_properties() -> None:
    del bpy.types.Object.radiosity_density_factor
    del bpy.types.Object.radiosity_own_resolution
