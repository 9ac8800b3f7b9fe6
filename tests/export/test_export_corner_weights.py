"""Corner maps: applied to colors of the user's loops they give what Blender itself shows."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.export.corner_weights import nearest_in_triangle
from tests.export.stage import add_object, add_plane

MODIFIERS = {
    "none": [],
    "simple subdivision": [("SUBSURF", {"subdivision_type": "SIMPLE", "render_levels": 2})],
    "subdivision surface": [("SUBSURF", {"render_levels": 2})],
    "triangulate": [("TRIANGULATE", {})],
    "mirror": [("MIRROR", {})],
    "array": [("ARRAY", {"count": 3})],
    "solidify": [("SOLIDIFY", {})],
    "edge split": [("EDGE_SPLIT", {})],
    "deform": [("SIMPLE_DEFORM", {"angle": 1.0})],
}
# Bevel's new strips take their colors from several faces at once; a corner has one source here.
NEARLY = {"bevel": [("BEVEL", {"width": 0.1, "segments": 2})]}


def add_cube(bpy, name="Cube"):
    corners = [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], quads)
    return add_object(bpy, name, mesh)


def add_modifiers(thing, modifiers):
    for kind, attributes in modifiers:
        modifier = thing.modifiers.new(kind, kind)
        for name, value in attributes.items():
            setattr(modifier, name, value)


def shown_and_ours(bpy, export, thing):
    """(3 n, 3) colors at the evaluated triangle corners: Blender's, and the corner map's."""
    colors = np.random.default_rng(1).random((len(thing.data.loops), 4)).astype(np.float32)
    attribute = thing.data.color_attributes.new("Paint", "FLOAT_COLOR", "CORNER")
    attribute.data.foreach_set("color", colors.reshape(-1))
    from radiosity_addon.export.pipeline import _render
    from radiosity_addon.export.traceless import traceless
    from radiosity_addon.settings import Settings

    with traceless():
        context = bpy.context
        parts = _render(
            context.scene, context.view_layer, [thing], Settings(), lambda fraction: None
        )[0]
    mesh = next(part.mesh for part in parts if part.name == thing.name)
    shown = mesh.colors["Paint"][mesh.triangle_loops].reshape(-1, 4)
    return shown, export(objects=(thing.name,)).objects[0].corner_map.matrix() @ colors


@pytest.mark.parametrize("name", MODIFIERS)
def test_colors_are_those_blender_shows(blender, export, name):
    cube = add_cube(blender)
    add_modifiers(cube, MODIFIERS[name])
    shown, ours = shown_and_ours(blender, export, cube)
    np.testing.assert_allclose(ours, shown, atol=1e-5)


@pytest.mark.parametrize("name", NEARLY)
def test_colors_are_nearly_those_blender_shows(blender, export, name):
    cube = add_cube(blender)
    add_modifiers(cube, NEARLY[name])
    shown, ours = shown_and_ours(blender, export, cube)
    # The faces themselves hold most corners and must be right; colors lie in [0, 1].
    assert np.median(np.abs(ours - shown)) < 0.01
    assert np.all((ours >= 0) & (ours <= 1))


def test_weights_are_an_average(blender, export):
    cube = add_cube(blender)
    add_modifiers(cube, [*NEARLY["bevel"], ("SUBSURF", {}), ("TRIANGULATE", {})])
    corner_map = export().objects[0].corner_map
    before = corner_map.weights.copy()
    weights = corner_map.matrix()
    assert np.array_equal(before, corner_map.weights)  # what is given is not used up
    assert weights.shape[1] == 24 and weights.min() >= 0
    np.testing.assert_allclose(np.asarray(weights.sum(axis=1)), 1.0)


def test_new_geometry_is_skipped_with_a_reason(blender, export):
    add_plane(blender, "Plain")
    add_modifiers(add_cube(blender), [("REMESH", {})])
    exported = export()
    assert [o.name for o in exported.objects] == ["Plain"]
    assert exported.skipped[0][0] == "Cube" and "traced back" in exported.skipped[0][1]
    assert "Cube" in exported.scene.objects


def test_polygon_of_five_corners(blender, export):
    angles = np.arange(5) * 2 * np.pi / 5
    mesh = blender.data.meshes.new("Five")
    mesh.from_pydata([(np.cos(a), np.sin(a), 0) for a in angles], [], [tuple(range(5))])
    thing = add_object(blender, "Five", mesh)
    add_modifiers(thing, [("SUBSURF", {"subdivision_type": "SIMPLE", "render_levels": 2})])
    exported = export()
    # Barycentric weights reproduce linear functions: the corners' own places. Blender subdivides
    # vertices and corner colors of such faces by weights that differ by up to 1 %.
    places = np.array([mesh.vertices[v].co for v in exported.objects[0].loop_vertex])
    corners = exported.scene.vertices[exported.scene.triangles].reshape(-1, 3)
    np.testing.assert_allclose(exported.objects[0].corner_map.matrix() @ places, corners, atol=0.01)


def test_nearest_in_triangle():
    corners = np.array([[(0, 0, 0), (1, 0, 0), (0, 1, 0)]] * 3, float)
    points = np.array([(0.25, 0.25, 0), (0.25, 0.25, 2), (-1, 0, 0)], float)
    weights, distance = nearest_in_triangle(corners, points)
    np.testing.assert_allclose(weights[:2], [(0.5, 0.25, 0.25)] * 2)
    np.testing.assert_allclose(weights[2], (1, 0, 0))
    np.testing.assert_allclose(distance, (0, 2, 1))


def test_modifiers_that_change_faces_are_named(blender, export):
    thing = add_cube(blender)
    add_modifiers(thing, NEARLY["bevel"] + MODIFIERS["deform"])
    assert export().objects[0].modifiers == ("BEVEL",)
    assert export().objects[0].n_loops == len(thing.data.loops) == 24
