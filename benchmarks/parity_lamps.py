"""Parity cases of lamps."""

from __future__ import annotations

from functools import partial
from math import cos, radians, sin

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
    """A disk stretched by its object's scale."""
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
    """A sun, a spot and a colored point lamp at once."""
    thing = stage()
    lamp("SUN", (0, 0, 5), TILTED, energy=1.0, angle=0.05)
    lamp("SPOT", HIGH, TILTED, energy=200.0, spot_size=1.2, shadow_soft_size=0.1)
    lamp("POINT", (1.5, -1.5, 1.0), energy=40.0, color=(1.0, 0.3, 0.1), shadow_soft_size=0.05)
    return thing


def luminaire(across, polar=range(0, 181, 15), kind="POINT", rotation=(0.3, 0.2, 0.5), scale=None,
              wheel=None, **values):  # fmt: skip
    """A lamp with the IES text of a luminaire that was measured at the angles ``across`` and
    ``polar`` [degrees]; ``wheel`` tints it by direction."""
    import bpy

    thing = stage()
    placed = lamp(kind, HIGH, rotation, energy=1.0, **{"shadow_soft_size": 0.0} | values)
    placed.scale = scale or (1.0, 1.0, 1.0)
    tree = empty_tree(placed.data)
    node = add_node(tree, "TexIES", Strength=1.0)
    node.mode, node.ies = "INTERNAL", bpy.data.texts.new("Luminaire")
    node.ies.write(photometry(across, polar))
    emission = add_node(tree, "Emission", Strength=node.outputs[0])
    if wheel:
        wheel = add_node(tree, "VectorMath")  # Add is what it does
        tree.links.new(add_node(tree, "TexCoord").outputs["Normal"], wheel.inputs[0])
        wheel.inputs[1].default_value = (1.2, 1.2, 1.2)
        tree.links.new(wheel.outputs[0], emission.inputs["Color"])
    tree.links.new(emission.outputs[0], add_node(tree, "OutputLight").inputs["Surface"])
    return thing


def photometry(across, polar) -> str:
    """IESNA LM-63 text, type C: candela rise with the angle across and swing with the polar one."""
    rows = [
        [12000 * (1.2 + cos(radians(2 * v))) * (1 + 0.5 * sin(radians(h))) for v in polar]
        for h in across
    ]
    head = f"1 1000 1.0 {len(polar)} {len(across)} 1 2 0 0 0\n1.0 1.0 100"
    lines = [" ".join(f"{x:g}" for x in row) for row in (polar, across, *rows)]
    return "\n".join(["IESNA:LM-63-1995", "[TEST] Parity", "TILT=NONE", head, *lines, ""])


DOWN, ROUND = range(0, 91, 5), range(0, 361, 30)
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
    Case("area, disk", partial(area, shape="DISK")),
    Case("area, ellipse", partial(area, shape="ELLIPSE", size=2.0, size_y=0.5)),
    Case("area, spread 60°", partial(area, spread=radians(60))),
    Case("area, disk scaled 0.5 × 2", scaled_area),
    Case("point, exposure 1", partial(lit_by, "POINT", energy=80.0, exposure=1.0)),
    Case("point, 3000 K", partial(lit_by, "POINT", energy=80.0, use_temperature=True,
                                  temperature=3000.0)),
    Case("point, node tree", node_lamp),
    Case("sun, spot and point", several),
    Case("IES, alike all around", partial(luminaire, (0,)), effort=2),
    Case("IES, downward only, radius 0.2", partial(luminaire, (0,), DOWN, shadow_soft_size=0.2),
         effort=2),
    Case("IES, a quarter measured", partial(luminaire, range(0, 91, 15)), effort=2),
    Case("IES, a half measured", partial(luminaire, range(0, 181, 30)), effort=2),
    Case("IES, all around, scaled", partial(luminaire, ROUND, scale=(2.0, 1.0, 0.5)), effort=2),
    Case("IES, spot, blend 0.5", partial(luminaire, ROUND, kind="SPOT", spot_size=radians(80),
                                         spot_blend=0.5), effort=4),
    Case("IES, radius 0.3, no soft falloff", partial(
        luminaire, ROUND, shadow_soft_size=0.3, use_soft_falloff=False), effort=4),
    Case("IES, color by direction", partial(luminaire, (0,), wheel=True), effort=2),
)  # fmt: skip
