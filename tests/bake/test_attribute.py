"""The color attribute: written, overwritten, and nothing else of the mesh touched."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.bake.attribute import write_colors
from tests.export.scene_building import linked


@pytest.fixture
def quad(blender):
    """Object Quad: two triangles around four vertices, and a fifth vertex without a face."""
    mesh = blender.data.meshes.new("Quad")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (9, 9, 9)], [],
                     [(0, 1, 2), (0, 2, 3)])
    obj = blender.data.objects.new("Quad", mesh)
    blender.context.scene.collection.objects.link(obj)
    return obj


def read(obj, name):
    data = obj.data.color_attributes[name].data
    values = np.empty(4 * len(data), np.float32)
    data.foreach_get("color", values)
    return values.reshape(-1, 4)


CORNERS = np.arange(18.0).reshape(6, 3)
POINTS = np.arange(12.0).reshape(4, 3)


def test_corners_keep_linear_floats_above_one(quad):
    assert write_colors(quad, "Radiosity", CORNERS, "corner") == []
    attribute = quad.data.color_attributes["Radiosity"]
    assert (attribute.data_type, attribute.domain) == ("FLOAT_COLOR", "CORNER")
    assert np.array_equal(read(quad, "Radiosity"), np.c_[CORNERS, np.ones(6)])


def test_points_without_faces_are_black(quad):
    write_colors(quad, "Radiosity", POINTS, "point")
    assert quad.data.color_attributes["Radiosity"].domain == "POINT"
    assert np.array_equal(read(quad, "Radiosity")[:4, :3], POINTS)
    assert read(quad, "Radiosity")[4].tolist() == [0, 0, 0, 1]


def test_the_first_attribute_is_active_and_renders(quad):
    write_colors(quad, "Radiosity", CORNERS, "corner")
    layers = quad.data.color_attributes
    assert layers.active_color.name == layers[layers.render_color_index].name == "Radiosity"


def test_the_users_attribute_keeps_rendering(quad):
    layers = quad.data.color_attributes
    layers.new("Mine", "BYTE_COLOR", "CORNER")
    write_colors(quad, "Radiosity", CORNERS, "corner")
    assert layers.active_color.name == "Radiosity"
    assert layers[layers.render_color_index].name == "Mine"


def test_baking_again_changes_values_only(quad):
    layers = quad.data.color_attributes
    write_colors(quad, "Radiosity", CORNERS, "corner")
    layers.new("Mine", "BYTE_COLOR", "CORNER")
    layers.active_color = layers["Mine"]
    assert write_colors(quad, "Radiosity", CORNERS + 1, "corner") == []
    assert layers.active_color.name == "Mine" and len(layers) == 2
    assert np.array_equal(read(quad, "Radiosity")[:, :3], CORNERS + 1)


@pytest.mark.parametrize("kind, domain", [("BYTE_COLOR", "CORNER"), ("FLOAT_COLOR", "POINT")])
def test_another_type_is_replaced_with_a_warning(quad, kind, domain):
    quad.data.color_attributes.new("Radiosity", kind, domain)
    (warning,) = write_colors(quad, "Radiosity", CORNERS, "corner")
    assert "'Quad'" in warning and kind in warning
    assert len(quad.data.color_attributes) == 1
    assert np.array_equal(read(quad, "Radiosity")[:, :3], CORNERS)


def test_a_uv_map_of_that_name_stays(quad):
    quad.data.uv_layers.new(name="Radiosity")
    (warning,) = write_colors(quad, "Radiosity", CORNERS, "corner")
    assert "'Radiosity Color'" in warning
    assert [layer.name for layer in quad.data.uv_layers] == ["Radiosity"]
    assert np.array_equal(read(quad, "Radiosity Color")[:, :3], CORNERS)
    write_colors(quad, "Radiosity", CORNERS, "corner")
    assert len(quad.data.color_attributes) == 1


def test_edit_mode_is_kept(quad, blender):
    blender.context.view_layer.objects.active = quad
    blender.ops.object.mode_set(mode="EDIT")
    write_colors(quad, "Corners", CORNERS, "corner")
    write_colors(quad, "Points", POINTS, "point")
    assert quad.mode == "EDIT"
    blender.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(read(quad, "Corners")[:, :3], CORNERS)
    assert np.array_equal(read(quad, "Points")[:4, :3], POINTS)


def test_a_changed_mesh_is_refused_and_left_alone(quad):
    with pytest.raises(ValueError, match="'Quad' has 6 corners where 7 were baked"):
        write_colors(quad, "Radiosity", np.zeros((7, 3)), "corner")
    with pytest.raises(ValueError, match="5 points where 6"):
        write_colors(quad, "Radiosity", np.zeros((6, 3)), "point")
    assert len(quad.data.color_attributes) == 0


def test_a_name_too_long_is_refused(quad):
    with pytest.raises(ValueError, match="63 bytes"):
        write_colors(quad, "x" * 64, CORNERS, "corner")


def test_linked_mesh_is_refused(quad, blender, tmp_path):
    path = str(tmp_path / "library.blend")
    blender.data.libraries.write(path, {quad})
    blender.ops.wm.read_factory_settings(use_empty=True)
    item = linked(blender, path, "Quad")
    with pytest.raises(ValueError, match="'Quad' is linked.*[Mm]ake it"):
        write_colors(item, "Radiosity", CORNERS, "corner")
