"""Parity cases of lamps. Depends on bpy."""

from __future__ import annotations

from functools import partial
from math import radians

from .parity_stage import Case, add_node, area_lamp, empty_tree, lamp, stage

HIGH, TILTED = (0.7, -0.8, 2.6), (0.5, 0.3, 0.0)


def lit_by(kind: str, location=HIGH, rotation=TILTED, **values):
    """The stage under one lamp of these settings, as far as this Blender has them."""
    thing = stage()
    known = {n: v for n, v in values.items() if hasattr_of_lamp(kind, n)}
    lamp(kind, location, rotation, **known)
    return thing


def hasattr_of_lamp(kind: str, name: str) -> bool:
    """Whether lamps of this Blender have the setting."""
    import bpy

    probe = bpy.data.lights.new("Probe", kind)
    try:
        return hasattr(probe, name)
    finally:
        bpy.data.lights.remove(probe)


def area(**values):
    thing = stage()
    area_lamp(**values)
    return thing


def scaled_area():
    """A disc stretched by its object's scale."""
    thing = stage()
    area_lamp(shape="DISK").scale = (0.5, 2.0, 1.0)
    return thing


def node_lamp():
    """A point lamp whose node tree makes it blue and twice as strong."""
    thing = stage()
    data = lamp("POINT", HIGH, energy=150.0, shadow_soft_size=0.1).data
    tree = empty_tree(data)
    emission = add_node(tree, "Emission", Color=(0.2, 0.5, 1.0, 1.0), Strength=2.0)
    tree.links.new(emission.outputs[0], add_node(tree, "OutputLight").inputs["Surface"])
    return thing


def several():
    """A sun, a spot and a coloured point lamp at once."""
    thing = stage()
    lamp("SUN", (0, 0, 5), TILTED, energy=1.0, angle=0.05)
    lamp("SPOT", HIGH, TILTED, energy=200.0, spot_size=1.2, shadow_soft_size=0.1)
    lamp("POINT", (1.5, -1.5, 1.0), energy=40.0, color=(1.0, 0.3, 0.1), shadow_soft_size=0.05)
    return thing


SPOT = partial(lit_by, "SPOT", energy=400.0, spot_size=radians(65))
CASES = (
    Case("point", partial(lit_by, "POINT", energy=150.0, shadow_soft_size=0.0)),
    Case("point, radius 0.3", partial(lit_by, "POINT", energy=150.0, shadow_soft_size=0.3)),
    Case("point, radius 0.3, no soft falloff", partial(
        lit_by, "POINT", energy=150.0, shadow_soft_size=0.3, use_soft_falloff=False)),
    Case("point, radius 0.8, cut by the floor, no soft falloff", partial(
        lit_by, "POINT", (1.1, -1.0, 0.6), energy=150.0, shadow_soft_size=0.8,
        use_soft_falloff=False)),
    Case("spot, blend 0.5", partial(SPOT, spot_blend=0.5, shadow_soft_size=0.0), effort=4),
    Case("spot, blend 0, radius 0.2", partial(SPOT, spot_blend=0.0, shadow_soft_size=0.2)),
    Case("spot, blend 1, radius 0.2", partial(SPOT, spot_blend=1.0, shadow_soft_size=0.2),
         effort=16),
    Case("spot, blend 1, radius 0.2, no soft falloff", partial(
        SPOT, spot_blend=1.0, shadow_soft_size=0.2, use_soft_falloff=False), effort=8),
    Case("sun, angle 0", partial(lit_by, "SUN", energy=3.0, angle=0.0)),
    Case("sun, angle 10°", partial(lit_by, "SUN", energy=3.0, angle=radians(10))),
    Case("area, square", area),
    Case("area, rectangle", partial(area, shape="RECTANGLE", size=2.0, size_y=0.3)),
    Case("area, disc", partial(area, shape="DISK")),
    Case("area, ellipse", partial(area, shape="ELLIPSE", size=2.0, size_y=0.5)),
    Case("area, spread 60°", partial(area, spread=radians(60))),
    Case("area, disc scaled 0.5 × 2", scaled_area),
    Case("point, exposure 1", partial(lit_by, "POINT", energy=80.0, exposure=1.0)),
    Case("point, 3000 K", partial(lit_by, "POINT", energy=80.0, use_temperature=True,
                                  temperature=3000.0)),
    Case("point, node tree", node_lamp),
    Case("sun, spot and point", several),
)  # fmt: skip
