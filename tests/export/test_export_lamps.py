"""Lamps: irradiance from the exported numbers against Cycles' bake of a small plane.

The plane is 2 cm wide at the origin; lamps are 2 m above it. Cycles gives E/π for reflectance 1,
and its rays to lamps that small carry next to no noise.
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from radiosity_addon.export.lamps import read_lamp
from radiosity_addon.export.light_objects import distribution_product
from radiosity_addon.export.scaled_beam import scaled_beam, widest_cone
from radiosity_addon.solver.lights.sky import pixel_directions
from radiosity_addon.solver.scene import AreaLamp
from tests.export.lamp_formulas import add_lamp, irradiance, shape_at
from tests.export.scene_building import add_plane, cycles_bake, diffuse

CASES = {
    "point": ("POINT", {"shadow_soft_size": 0.0}),
    "soft point": ("POINT", {"shadow_soft_size": 0.5}),
    "ball": ("POINT", {"shadow_soft_size": 0.5, "use_soft_falloff": False}),
    "ball around the plane": ("POINT", {"shadow_soft_size": 2.5, "use_soft_falloff": False}),
    "spot ball": (
        "SPOT",
        {"shadow_soft_size": 0.2, "use_soft_falloff": False, "spot_size": 2.0, "spot_blend": 0.0},
    ),
    "scaled point": ("POINT", {"shadow_soft_size": 0.1, "scale": (2, 2, 2)}),
    "colored point": ("POINT", {"shadow_soft_size": 0.0, "color": (1.0, 0.5, 0.25)}),
    "point, energy as radiance": ("POINT", {"shadow_soft_size": 0.5, "normalize": False}),
    "sharp point, energy as radiance": ("POINT", {"shadow_soft_size": 0.0, "normalize": False}),
    "point, exposure": ("POINT", {"shadow_soft_size": 0.0, "exposure": 1.5}),
    "point, 3000 K": (
        "POINT",
        {"shadow_soft_size": 0.0, "use_temperature": True, "temperature": 3000.0},
    ),
    "spot": ("SPOT", {"shadow_soft_size": 0.0, "spot_blend": 0.0, "spot_size": 1.0}),
    "spot, blended": (
        "SPOT",
        {"shadow_soft_size": 0.0, "spot_blend": 1.0, "spot_size": 1.0, "turn": 0.2},
    ),
    "wide spot": ("SPOT", {"shadow_soft_size": 0.0, "spot_blend": 0.5, "spot_size": 1.0, "turn": 0.45, "scale": (2, 2, 1)}),
    "long spot": ("SPOT", {"shadow_soft_size": 0.0, "spot_blend": 0.5, "spot_size": 1.0, "turn": 0.3, "scale": (-1, 2, 1.5)}),
    "flat spot": ("SPOT", {"shadow_soft_size": 0.0, "spot_blend": 1.0, "spot_size": 1.2, "turn": 0.6, "scale": (1, 1, 0.5)}),
    "half-space spot": ("SPOT", {"shadow_soft_size": 0.0, "spot_blend": 1.0, "spot_size": 3.14159, "turn": 0.9, "scale": (1, 3, 1)}),
    "sun": ("SUN", {"angle": 0.0, "turn": 0.3}),
    "wide sun": ("SUN", {"angle": 0.3}),
    "sun, strength as radiance": ("SUN", {"angle": 0.3, "normalize": False}),
    "square": ("AREA", {"size": 0.01}),
    "scaled square": ("AREA", {"size": 0.01, "scale": (2, 3, 1)}),
    "square, energy as radiosity": ("AREA", {"size": 0.01, "normalize": False}),
    "rectangle": ("AREA", {"shape": "RECTANGLE", "size": 0.01, "size_y": 0.03, "turn": 0.3}),
    "disk": ("AREA", {"shape": "DISK", "size": 0.02}),
    "ellipse": ("AREA", {"shape": "ELLIPSE", "size": 0.01, "size_y": 0.03}),
    "narrow beam": ("AREA", {"size": 0.01, "spread": 2.0, "turn": 0.2}),
}


@pytest.mark.parametrize("name", CASES)
def test_irradiance_is_that_of_cycles(blender, export, name):
    kind, attributes = CASES[name]
    data = blender.data.lights.new("Probe", kind)
    missing = [a for a in attributes if a not in ("scale", "turn") and not hasattr(data, a)]
    if missing:
        pytest.skip(f"this Blender has no light property {missing}")
    plane = add_plane(blender, size=0.02, material=diffuse(blender, (1, 1, 1)))
    add_lamp(blender, kind, energy=100.0, **attributes)
    exported = export()
    lamp = exported.scene.lamps[0]
    ours = irradiance(lamp)
    if getattr(lamp, "distribution", None) is not None:
        ours = ours * shape_at(lamp, -lamp.position)
    theirs = cycles_bake(blender, plane, samples=64)[0, 0] * np.pi
    # Cycles bakes one of the plane's two triangles, 3 mm off the middle: 0.0017 rad. The blended
    # beams change by up to 2 per radian there, everything else by less than 1.
    tolerance = 4e-3 if name in ("spot, blended", "flat spot", "narrow beam") else 2e-3
    np.testing.assert_allclose(ours, theirs, rtol=tolerance)
    assert not exported.warnings


def test_area_lamp_is_placed_by_its_transform(blender, export):
    add_plane(blender)
    lamp = add_lamp(blender, "AREA", energy=1.0, shape="RECTANGLE", size=2.0, size_y=1.0)
    lamp.rotation_euler = (np.pi / 2, 0, 0)  # turned about x: shines toward +y
    exported = export().scene.lamps[0]
    assert isinstance(exported, AreaLamp)
    np.testing.assert_allclose(exported.normal, (0, 1, 0), atol=1e-6)
    np.testing.assert_allclose(exported.u, (2, 0, 0), atol=1e-6)
    np.testing.assert_allclose(exported.v, (0, 0, 1), atol=1e-6)
    np.testing.assert_allclose(exported.radiance, 1 / (np.pi * 2.0), rtol=1e-6)  # P / (π A)


@pytest.mark.parametrize("attributes", [{"energy": 0.0}, {"color": (0.0, 0.0, 0.0)}])
def test_dark_lamps_are_left_out_and_named(blender, export, attributes):
    add_plane(blender)
    add_lamp(blender, "POINT", **attributes)
    exported = export()
    assert exported.scene.lamps == ()
    assert any('lamp "Lamp" has no energy' in text for text in exported.warnings)


BAD = {
    "negative": ("POINT", {"energy": -5.0}, 0, "negative"),
    "infinite": ("POINT", {"energy": float("inf")}, 0, "above 1e+37"),  # kept as 3.4e38
    "no size": ("AREA", {"energy": 1.0, "size": 0.0}, 1, "no size"),
    "scaled to nothing": ("AREA", {"energy": 1.0, "scale": (0, 1, 1)}, 1, "no size"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_lamps_warn_and_stay_finite(blender, export, name):
    kind, attributes, count, words = BAD[name]
    add_plane(blender)
    add_lamp(blender, kind, **attributes)
    exported = export()
    assert len(exported.scene.lamps) == count
    (told,) = [w for w in exported.warnings if "Lamp" in w]
    assert words in told
    for lamp in exported.scene.lamps:
        for value in vars(lamp).values():
            assert isinstance(value, str) or np.all(np.isfinite(np.asarray(value, float)))


@pytest.mark.parametrize("place", [float("nan"), 1e30])
@pytest.mark.parametrize("kind", ["POINT", "SUN"])
def test_lamps_that_are_nowhere_are_left_out_and_named(blender, export, kind, place):
    """A sun lights from everywhere alike, but that its matrix is one of numbers."""
    add_plane(blender)
    add_lamp(blender, kind, energy=1.0).location.x = place
    exported = export()
    told = [w for w in exported.warnings if w.startswith('lamp "Lamp" is left out')]
    assert len(told) == 1 - len(exported.scene.lamps) == (kind == "POINT")


def test_spot_without_cone(blender, export):
    add_plane(blender)
    lamp = add_lamp(blender, "SPOT", energy=1.0)
    lamp.data.spot_size = 0.0  # Blender keeps it at its own minimum of 1°
    assert export().scene.lamps[0].cone >= np.radians(1.0) - 1e-6


def test_cone_that_blender_would_not_keep():
    """A file made by other means may hold any cone."""
    light = SimpleNamespace(type="SPOT", color=(1, 1, 1), energy=1.0, shadow_soft_size=0.0,
                            spot_size=0.0, spot_blend=0.0)  # fmt: skip
    warnings = []
    lamp = read_lamp(SimpleNamespace(name="Beam", data=light), np.eye(4), warnings)
    assert lamp.cone == pytest.approx(np.radians(1.0))
    assert warnings == ['spot "Beam" has a cone of 0°; 1° is used']


def test_node_tree_sets_color_and_strength(blender, export):
    add_plane(blender)
    lamp = add_lamp(blender, "POINT", energy=4 * np.pi, shadow_soft_size=0.0)
    if not lamp.data.node_tree:
        lamp.data.use_nodes = True
    inputs = lamp.data.node_tree.nodes["Emission"].inputs
    inputs["Color"].default_value = (1.0, 0.5, 0.0, 1.0)
    inputs["Strength"].default_value = 3.0
    # Intensity P/4π = 1, times color and strength of the Emission node.
    np.testing.assert_allclose(export().scene.lamps[0].intensity, (3.0, 1.5, 0.0), rtol=1e-6)


def test_lamp_hidden_from_diffuse_rays_is_left_out(blender, export):
    add_plane(blender)
    add_lamp(blender, "POINT", energy=10.0).visible_diffuse = False
    assert export().scene.lamps == ()


def test_lamp_whose_tree_has_no_shader_is_named(blender, export):
    add_plane(blender)
    lamp = add_lamp(blender, "POINT", energy=10.0)
    if not lamp.data.node_tree:
        lamp.data.use_nodes = True
    lamp.data.node_tree.links.clear()
    exported = export()
    assert exported.scene.lamps == ()
    assert any('lamp "Lamp" has no shader linked' in w for w in exported.warnings)


def test_a_scaled_spot_lights_all_of_its_cone_and_keeps_what_nodes_make_of_it():
    """Scaled by 1, 3, ½ a cone of 60° reaches as far as atan(6 tan 30°) along its second axis, and as atan(2 tan 30°) along its first."""
    axes, cone = np.diag([1.0, 3.0, 0.5]), np.radians(60)
    picture = scaled_beam(axes, cone, 0.0)
    directions = pixel_directions(*picture.shape)
    along = directions[..., 0] ** 2 + directions[..., 1] ** 2 < -directions[..., 2] * 10  # a half-space's middle
    for axis, reach in ((0, 2 * np.tan(cone / 2)), (1, 6 * np.tan(cone / 2))):
        thin = along & (np.abs(directions[..., 1 - axis]) < 8e-3) & (directions[..., 2] < 0)
        slope = np.abs(directions[..., axis] / directions[..., 2])[thin]
        assert slope[picture[thin] > 0.5].max() == pytest.approx(reach, rel=0.02)
    widest = widest_cone(np.diag(axes), cone)
    inside = -directions[..., 2] >= np.cos(widest / 2)
    assert not picture[~inside].any() and widest == pytest.approx(2 * np.arctan(6 * np.tan(cone / 2)), rel=0.02)
    coarse = np.array([[0.5, 1.0], [0.0, 0.25]])
    both = distribution_product(picture, coarse)
    half = len(picture) // 2
    for row, factors in ((slice(half), (0.5, 1.0)), (slice(half, None), (0.0, 0.25))):
        expected = picture[row] * np.repeat(factors, picture.shape[1] // 2)
        assert np.array_equal(both[row], expected)
    assert distribution_product(coarse, None) is coarse


def test_a_lamp_of_a_flat_matrix_stays_round(blender, export):
    lamp = add_lamp(blender, "SPOT", energy=1.0, scale=(1, 0, 1))
    add_plane(blender)
    (only,) = export().scene.lamps
    assert lamp.scale[1] == 0 and only.distribution is None
