"""UV maps: made where missing, without overlaps; nothing of the user's changes."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.bake.overlaps import overlap_steps
from radiosity_addon.bake.texels import overlapping_texels, texel_receivers
from radiosity_addon.bake.unwrap import ensure_uv_map
from radiosity_addon.bake.uv_maps import find_uv_map, remove_uv_maps
from radiosity_addon.bake_job import prepare
from radiosity_addon.settings import Settings
from radiosity_addon.steps import finish
from tests.export.scene_building import linked


def add(blender, name, points, faces):
    mesh = blender.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    obj = blender.data.objects.new(name, mesh)
    blender.context.scene.collection.objects.link(obj)
    return obj


@pytest.fixture
def box(blender):
    """A box of 1 × 2 × 4, closed."""
    points = [(x, 2 * y, 4 * z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return add(blender, "Box", points, faces)


def triangles_uv(obj, name="Radiosity"):
    mesh = obj.data
    uv = np.empty(2 * len(mesh.loops), np.float32)
    mesh.uv_layers[name].data.foreach_get("uv", uv)
    mesh.calc_loop_triangles()
    loops = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    return uv.reshape(-1, 2)[loops].reshape(-1, 3, 2).astype(float)


def overlap(obj, resolution=256):
    uv = triangles_uv(obj)
    receivers = texel_receivers(uv, np.arange(len(uv)), resolution)
    return overlapping_texels(receivers, uv, 0, resolution), receivers


def test_flat_sides_become_charts_of_equal_texel_size(box):
    assert ensure_uv_map([box], resolution=256) == [("Box", "Radiosity")]
    uv = triangles_uv(box)
    assert uv.min() >= 0 and uv.max() <= 1
    edge_u, edge_v = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    area = np.abs(edge_u[:, 0] * edge_v[:, 1] - edge_u[:, 1] * edge_v[:, 0])
    size = area[::2]  # twice half of each side; sides are 1·2, 1·2, 1·4, 1·4, 2·4, 2·4
    assert size / size[0] == pytest.approx([1, 1, 2, 2, 4, 4], rel=1e-3)
    assert overlap(box)[0] == 0


def test_charts_are_three_texels_apart(box):
    """No texel between two charts is nearer than 1.5 texels to both: bilinear filtering at a
    chart's border reads texels of its own margin only."""
    from scipy.ndimage import distance_transform_edt, label

    ensure_uv_map([box], resolution=128)
    grid = overlap(box, 128)[1].grid
    covered = np.zeros((128, 128), bool)
    covered[grid[:, 1], grid[:, 2]] = True
    charts, count = label(covered, np.ones((3, 3)))
    assert count == 6
    for chart in range(1, 7):
        apart = distance_transform_edt(charts != chart)[covered & (charts != chart)]
        assert apart.min() >= 2


def test_scale_of_the_object_counts(box):
    box.scale = (2, 1, 0.5)  # 2 × 2 × 2: all sides alike
    import bpy

    bpy.context.view_layer.update()
    ensure_uv_map([box])
    uv = triangles_uv(box)
    edge_u, edge_v = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    area = np.abs(edge_u[:, 0] * edge_v[:, 1] - edge_u[:, 1] * edge_v[:, 0])
    assert area == pytest.approx(area[0], rel=1e-3)


@pytest.mark.parametrize("how", ["smart", "lightmap"])
@pytest.mark.parametrize("size", [1e-8, 4e5])
def test_size_does_not_matter(blender, size, how):
    """A ground of 400 km, or of 10 nm, fills the image as one of 1 m does: Blender's operators give no UVs to such."""
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    found = []
    for edge in (1.0, size):
        ground = add(blender, f"Ground {edge}", (edge * corners).tolist(), [(0, 1, 2, 3)])
        ensure_uv_map([ground], how=how)
        found.append(triangles_uv(ground))
    assert np.ptp(found[0], axis=(0, 1)) == pytest.approx([0.97, 0.97], abs=0.03)
    assert np.allclose(*found, atol=1e-3)  # a texel: Blender 5.3 packs to a sixteenth of one


def test_a_spiral_ramp_is_cut_apart(blender):
    """Three turns project onto one ring: 2/3 of it would lie on other faces."""
    turn = np.linspace(0, 6 * np.pi, 90)
    points = [(r * np.cos(a), r * np.sin(a), 0.1 * a) for r in (1, 2) for a in turn]
    faces = [(i, i + 1, 91 + i, 90 + i) for i in range(89)]
    ramp = add(blender, "Ramp", points, faces)
    ensure_uv_map([ramp], resolution=256)
    assert overlap(ramp)[0] == 0


def test_a_head_with_folds_does_not_overlap(blender):
    blender.ops.mesh.primitive_monkey_add()
    head = blender.context.object
    while head.data.uv_layers:
        head.data.uv_layers.remove(head.data.uv_layers[0])
    ensure_uv_map([head], resolution=256)
    count, receivers = overlap(head)
    assert count == 0 and receivers.count > 0.35 * 256**2


def test_layers_of_stacked_quads():
    """Two pairs of triangles on the same place: one pair may stay, the other must go."""
    half = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], float)
    uv = np.concatenate([half, half])
    corners = np.array([(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)])
    layer = finish(overlap_steps(uv, np.arange(4), corners, 4, 16))
    assert layer[0] != layer[2] and layer[1] != layer[3]
    assert not finish(overlap_steps(half, np.arange(2), corners[:2], 2, 16)).any()


def state(blender, obj):
    layers = obj.data.uv_layers
    return {
        "mode": blender.context.mode,
        "active": blender.context.view_layer.objects.active,
        "selected": [o.name for o in blender.context.selected_objects],
        "selected_faces": [face.select for face in obj.data.polygons],
        "active map": layers.active.name if layers.active else None,
        "rendered": [layer.name for layer in layers if layer.active_render],
        "colors": [a.name for a in obj.data.color_attributes],
        "materials": list(obj.data.materials),
        "data": [len(c) for c in (blender.data.objects, blender.data.meshes,
                                  blender.data.scenes, blender.data.images)],
        "scene": blender.context.scene.name,
    }


def test_the_users_state_does_not_change(box, blender):
    mine = box.data.uv_layers.new(name="Mine")
    box.data.uv_layers.new(name="Other").active_render = True
    mine.data[3].uv = (0.25, 0.75)
    box.data.uv_layers.active = box.data.uv_layers["Mine"]
    box.data.polygons[2].select = False
    box.data.polygons[3].hide = True
    blender.ops.mesh.primitive_plane_add()
    before = state(blender, box)
    made = ensure_uv_map([box])
    assert state(blender, box) == before
    assert tuple(box.data.uv_layers["Mine"].data[3].uv) == (0.25, 0.75)
    assert overlap(box)[1].count > 0.3 * 256**2  # the hidden face has its place too
    remove_uv_maps(made)
    assert state(blender, box) == before
    assert [layer.name for layer in box.data.uv_layers] == ["Mine", "Other"]


def test_edit_mode_is_kept(box, blender):
    blender.context.view_layer.objects.active = box
    blender.ops.object.mode_set(mode="EDIT")
    before = state(blender, box)
    ensure_uv_map([box])
    assert state(blender, box) == before | {"active map": "Radiosity", "rendered": ["Radiosity"]}
    blender.ops.object.mode_set(mode="OBJECT")
    assert overlap(box)[0] == 0 and overlap(box)[1].count > 0.3 * 256**2


def test_shared_meshes_share_the_map_and_existing_maps_stay(box, blender):
    twin = blender.data.objects.new("Twin", box.data)
    assert ensure_uv_map([box, twin]) == [("Box", "Radiosity")]
    before = triangles_uv(box)
    assert ensure_uv_map([box, twin]) == []
    assert np.array_equal(triangles_uv(box), before)


def test_maps_that_stay_although_another_unwrap_is_asked_for_are_told(box, blender):
    def told(**options) -> list[str]:
        settings = Settings(target="image", resolution=16, **options)
        return [text for text in prepare(blender.context, settings).warnings if "used as it is" in text]

    assert not told(unwrap="lightmap")  # which makes the map
    assert not told(unwrap="lightmap") and not told(uv_map="Radiosity")
    (text,) = told()
    assert "'Radiosity' of 'Box'" in text and "unwrap 'smart'" in text
    box.data.uv_layers.remove(box.data.uv_layers["Radiosity"])
    del box.data["radiosity_made"]
    box.data.uv_layers.new(name="Radiosity")  # by the user
    assert not told() and told(unwrap="existing")


def test_colors_of_that_name_stay(box):
    box.data.color_attributes.new("Radiosity", "FLOAT_COLOR", "CORNER")
    assert ensure_uv_map([box]) == [("Box", "Radiosity UV")]
    assert find_uv_map(box.data, "Radiosity") == "Radiosity UV"
    assert ensure_uv_map([box]) == []


def test_eight_maps_are_the_most(box, blender):
    other = add(blender, "Other", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    for number in range(8):
        box.data.uv_layers.new(name=f"map {number}")
    with pytest.raises(ValueError, match="'Box' has 8 UV maps.*remove one.*--uv-map"):
        ensure_uv_map([other, box])
    assert not other.data.uv_layers  # nothing was made


def test_bad_geometry_gets_a_map(blender):
    """NaN vertices, faces without area, a mesh without faces: a finite map, no error."""
    nan = float("nan")
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (nan, 0, 0), (2, 0, 0), (3, 0, 0)]
    bad = add(blender, "Bad", points, [(0, 1, 2, 3), (1, 4, 2), (1, 5, 6)])
    bare = add(blender, "Bare", [(0, 0, 0)], [])
    assert ensure_uv_map([bad, bare]) == [("Bad", "Radiosity"), ("Bare", "Radiosity")]
    uv = triangles_uv(bad)
    assert np.isfinite(uv).all() and uv.min() >= 0 and uv.max() <= 1


def test_linked_mesh_is_refused(box, blender, tmp_path):
    path = str(tmp_path / "library.blend")
    blender.data.libraries.write(path, {box})
    blender.ops.wm.read_factory_settings(use_empty=True)
    item = linked(blender, path, "Box")
    with pytest.raises(ValueError, match="'Box' is linked from another file"):
        ensure_uv_map([item])
