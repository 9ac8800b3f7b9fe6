"""Corner maps: applied to colors of the user's loops they give what Blender itself shows."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.export.corner_weights import nearest_in_triangle
from radiosity_addon.export.mesh_trace import DIGIT, MOST_CORNERS, _digits, _number
from tests.export.scene_building import add_object, add_plane

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
    "bevel": [("BEVEL", {"width": 0.1, "segments": 2})],
    "bevel and subdivision": [("BEVEL", {"width": 0.1}), ("SUBSURF", {}), ("TRIANGULATE", {})],
}


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


def shown_and_ours(bpy, export, thing, colors=None):
    """(3 n, 4) colors at the evaluated triangle corners: Blender's, and the corner map's; of
    ``colors`` (n_loops, 4), else random ones."""
    if colors is None:
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


def add_polygon(bpy, corners):
    """A polygon of so many corners, which is not regular."""
    angles = np.arange(corners) * 2 * np.pi / corners
    mesh = bpy.data.meshes.new("Polygon")
    mesh.from_pydata([(2 * np.cos(a), np.sin(a), 0) for a in angles], [], [tuple(range(corners))])
    return add_object(bpy, "Polygon", mesh)


@pytest.mark.parametrize("corners", [5, MOST_CORNERS])
def test_polygons_are_divided_as_blender_does(blender, export, corners):
    polygon = add_polygon(blender, corners)
    add_modifiers(polygon, MODIFIERS["simple subdivision"])
    shown, ours = shown_and_ours(blender, export, polygon)
    np.testing.assert_allclose(ours, shown, atol=1e-5)


def test_larger_polygons_have_barycentric_weights(blender, export):
    """They reproduce linear functions, of which the mean of any weights is that of the mean place."""
    polygon = add_polygon(blender, MOST_CORNERS + 1)
    add_modifiers(polygon, MODIFIERS["simple subdivision"])
    places = np.array([(*polygon.data.vertices[loop.vertex_index].co, 1) for loop in polygon.data.loops])
    shown, ours = shown_and_ours(blender, export, polygon, places.astype(np.float32))
    np.testing.assert_allclose(ours, shown, atol=1e-5)


def test_faces_that_a_boolean_cuts(blender, export):
    """A corner of another cube is cut out of a cube: faces of the cut are the other's and have no
    source; the cube's own, with holes in them, show what Blender does."""
    cube, cutter = add_cube(blender), add_cube(blender, "Cutter")
    cutter.location = 1.1, 1.2, 1.3
    cutter.hide_render = True
    modifier = cube.modifiers.new("Boolean", "BOOLEAN")
    modifier.object, modifier.operation = cutter, "DIFFERENCE"
    shown, ours = shown_and_ours(blender, export, cube)
    traced = (ours != 0).any(axis=1)
    assert 0.5 < traced.mean() < 1
    np.testing.assert_allclose(ours[traced], shown[traced], atol=1e-5)


def test_numbers_of_faces_are_told_from_means_of_several():
    """Faces come back; means of two that differ are of none: a digit of the mean fits by chance one
    time in a thousand."""
    faces = np.array([1, 2, DIGIT - 1, DIGIT, DIGIT + 1, 7_654_321, 2**24 - 1], np.int32)
    np.testing.assert_array_equal(_number(_digits(faces)), faces)
    one, other = np.random.default_rng(0).integers(1, 5000, (2, 20_000)).astype(np.int32)
    mean = (_digits(one) + _digits(other)) / 2
    assert (_number(mean)[one != other] != 0).mean() < 2e-3
    assert not _number(np.zeros((1, 3))).any() and not _number(np.full((1, 3), np.nan)).any()


def test_weights_are_an_average(blender, export):
    cube = add_cube(blender)
    add_modifiers(cube, MODIFIERS["bevel and subdivision"])
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


def test_nearest_in_triangle():
    corners = np.array([[(0, 0, 0), (1, 0, 0), (0, 1, 0)]] * 3, float)
    points = np.array([(0.25, 0.25, 0), (0.25, 0.25, 2), (-1, 0, 0)], float)
    weights, distance = nearest_in_triangle(corners, points)
    np.testing.assert_allclose(weights[:2], [(0.5, 0.25, 0.25)] * 2)
    np.testing.assert_allclose(weights[2], (1, 0, 0))
    np.testing.assert_allclose(distance, (0, 2, 1))


def test_modifiers_that_change_faces_are_named(blender, export):
    thing = add_cube(blender)
    add_modifiers(thing, MODIFIERS["bevel"] + MODIFIERS["deform"])
    assert export().objects[0].modifiers == ("BEVEL",)
    assert export().objects[0].n_loops == len(thing.data.loops) == 24
