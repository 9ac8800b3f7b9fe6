"""Geometry: what a render sees, in world space, wound the right way, without unsound faces."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.solver.expected import Refused
from tests.export.scene_building import add_object, add_plane, diffuse, linked


def normals(scene):
    corners = scene.vertices[scene.triangles]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return cross / np.linalg.norm(cross, axis=1, keepdims=True)


def test_render_settings_of_modifiers_count(blender, export):
    plane = add_plane(blender)
    levels = plane.modifiers.new("Levels", "SUBSURF")
    levels.subdivision_type, levels.levels, levels.render_levels = "SIMPLE", 0, 2
    plane.modifiers.new("Viewport only", "ARRAY").show_render = False
    render_only = plane.modifiers.new("Render only", "ARRAY")
    render_only.show_viewport, render_only.count = False, 3
    # 4² quads of two triangles, three times.
    assert len(export().scene.triangles) == 4**2 * 2 * 3


def test_vertices_stay_shared(blender, export):
    add_plane(blender).modifiers.new("Levels", "SUBSURF").render_levels = 2
    assert len(export().scene.vertices) == 5**2


@pytest.mark.parametrize("scale", [(2, 3, 4), (-2, 3, 4), (2, -3, -4), (-2, -3, -4)])
def test_front_stays_front_under_mirroring(blender, export, scale):
    plane = add_plane(blender)
    plane.scale = scale
    scene = export().scene
    # The normal is a direction of its own: scaled by sz alone it points to sign(sz) z.
    np.testing.assert_allclose(normals(scene), [(0, 0, np.sign(scale[2]))] * 2, atol=1e-6)
    extent = np.ptp(scene.vertices, axis=0)
    np.testing.assert_allclose(extent, (2 * abs(scale[0]), 2 * abs(scale[1]), 0), atol=1e-5)


def test_mirrored_corners_keep_their_uv(blender, export):
    plane = add_plane(blender, uv="Radiosity")
    plane.scale = (-1, 1, 1)
    exported = export(target="image")
    uv = exported.objects[0].uv.reshape(-1, 2)
    places = exported.scene.vertices[exported.scene.triangles].reshape(-1, 3)
    # On the square of edge 2 the map is u = (x_local + 1) / 2, v = (y + 1) / 2; x_local = -x.
    np.testing.assert_allclose(uv, (places[:, :2] * (-1, 1) + 1) / 2, atol=1e-6)


def test_hidden_objects(blender, export):
    scene = blender.context.scene
    add_plane(blender, "Shown")
    add_plane(blender, "No render").hide_render = True
    add_plane(blender, "No viewport").hide_viewport = True
    hidden = blender.data.collections.new("Hidden")
    scene.collection.children.link(hidden)
    hidden.hide_render = True
    hidden.objects.link(blender.data.objects.new("In hidden", blender.data.meshes["Shown"]))
    away = blender.data.collections.new("Excluded")
    scene.collection.children.link(away)
    away.objects.link(blender.data.objects.new("Away", blender.data.meshes["Shown"]))
    blender.context.view_layer.layer_collection.children["Excluded"].exclude = True
    exported = export(target="vertex")
    assert exported.scene.objects == ("No viewport", "Shown")
    assert exported.skipped == ()


def test_named_but_hidden_object_says_why(blender, export):
    add_plane(blender, "Shown")
    add_plane(blender, "Hidden").hide_render = True
    exported = export(objects=("Shown", "Hidden"))
    assert exported.skipped == (("Hidden", "is not visible in renders"),)


def test_others_still_take_part(blender, export):
    add_plane(blender, "A")
    add_plane(blender, "B")
    exported = export(objects=("B",))
    assert [o.name for o in exported.objects] == ["B"]
    assert exported.scene.objects == ("B", "A")
    assert (exported.objects[0].start, exported.objects[0].stop) == (0, 2)


def test_instances_take_part_but_are_not_baked(blender, export):
    add_plane(blender, "Floor")
    kept = blender.data.collections.new("Kept")
    add_plane(blender, "Instanced")
    thing = blender.data.objects["Instanced"]
    blender.context.scene.collection.objects.unlink(thing)
    kept.objects.link(thing)
    empty = add_object(blender, "Empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", kept
    empty.location = (0, 0, 5)
    exported = export()
    assert exported.scene.objects == ("Floor", "Empty: Instanced")
    assert [o.name for o in exported.objects] == ["Floor"]
    triangles = exported.scene.triangles[exported.scene.object == 1]
    np.testing.assert_allclose(exported.scene.vertices[triangles][..., 2], 5.0)


def test_particles_and_geometry_nodes_instances(blender, export):
    floor = add_plane(blender, "Floor")
    leaf = add_plane(blender, "Leaf", size=0.1)
    leaf.hide_render = True
    emitter = floor.modifiers.new("Particles", "PARTICLE_SYSTEM").particle_system.settings
    emitter.render_type, emitter.instance_object = "OBJECT", leaf
    emitter.count, emitter.frame_start, emitter.frame_end = 3, 0, 0
    scatter = add_plane(blender, "Scatter")
    tree = blender.data.node_groups.new("Scatter", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    copies, info = (tree.nodes.new(f"GeometryNode{n}") for n in ("InstanceOnPoints", "ObjectInfo"))
    info.inputs["Object"].default_value = leaf
    tree.links.new(start.outputs[0], copies.inputs["Points"])
    tree.links.new(info.outputs["Geometry"], copies.inputs["Instance"])
    tree.links.new(copies.outputs[0], end.inputs[0])
    scatter.modifiers.new("Nodes", "NODES").node_group = tree
    exported = export()
    # The floor; three particles; a leaf on each of the four corners in place of the plane itself.
    assert len(exported.scene.objects) == 1 + 3 + 4
    assert [o.name for o in exported.objects] == ["Floor"]
    assert exported.skipped == (("Scatter", "has no faces with area when it is rendered"),)


def test_curves_and_texts_take_part(blender, export):
    add_plane(blender, "Floor")
    text = blender.data.curves.new("Text", "FONT")
    text.body = "l"
    add_object(blender, "Text", text)
    exported = export()
    assert exported.scene.objects == ("Floor", "Text")
    assert np.sum(exported.scene.object == 1) > 0
    with pytest.raises(ValueError, match="no mesh to bake.*Text.*font"):
        export(objects=("Text",))


def test_unsound_faces_are_left_out_with_a_warning(blender, export):
    mesh = blender.data.meshes.new("Broken")
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (np.nan, 0, 0), (0, np.inf, 0), (2, 0, 0)]
    mesh.from_pydata(points, [], [(0, 1, 2), (0, 1, 3), (0, 2, 4), (0, 1, 5)])
    add_object(blender, "Broken", mesh)
    exported = export()
    assert len(exported.scene.triangles) == 1
    assert np.all(np.isfinite(exported.scene.vertices))
    assert exported.warnings[:2] == (
        "object 'Broken': 2 triangles with vertices that are NaN, infinite or beyond 1e+18 left out",
        "object 'Broken': 1 triangles without area left out",
    )


@pytest.mark.parametrize("count, told", [
    (1, "object 'Broken0': 1 triangles"),
    (2, "objects 'Broken1', 'Broken0': 3 triangles"),
    (5, "objects 'Broken4', 'Broken3', 'Broken2' and 2 more: 15 triangles"),
])  # fmt: skip
def test_triangles_left_out_of_several_objects_are_told_at_once(blender, export, count, told):
    """Each object has one more without area than the one before."""
    for number in range(count):
        mesh = blender.data.meshes.new("Broken")
        points = [(0, 0, 0), (0, 1, 0), *((x, 0, 0) for x in range(1, number + 3))]
        mesh.from_pydata(points, [], [(0, 1, 2), *((0, 2, 3 + k) for k in range(number + 1))])
        add_object(blender, f"Broken{number}", mesh)
    assert [text for text in export().warnings if "left out" in text] == [f"{told} without area left out"]


@pytest.mark.parametrize("value, reason", [(np.nan, "NaN"), (1.0, "no faces with area")])
def test_an_object_is_left_out_for_what_its_vertices_are(blender, export, value, reason):
    add_plane(blender, "Floor")
    mesh = blender.data.meshes.new("Broken")
    mesh.from_pydata([(value, 0, 0), (1, 0, 0), (1, 0, 0)], [], [(0, 1, 2)])
    add_object(blender, "Broken", mesh)
    ((name, told),) = export().skipped
    assert name == "Broken" and reason in told


def test_mesh_in_edit_mode_is_up_to_date(blender, export):
    plane = add_plane(blender)
    blender.context.view_layer.objects.active = plane
    blender.ops.object.mode_set(mode="EDIT")
    blender.ops.mesh.select_all(action="SELECT")
    blender.ops.transform.translate(value=(0, 0, 3))
    scene = export().scene
    np.testing.assert_allclose(scene.vertices[:, 2], 3.0)
    assert plane.mode == "EDIT"


def test_no_mesh(blender, export):
    with pytest.raises(ValueError, match="no mesh to bake"):
        export()
    add_plane(blender, "Floor").hide_render = True
    with pytest.raises(ValueError, match="no mesh to bake.*'Floor' is left out: is not visible in renders"):
        export()


def test_unknown_name(blender, export):
    add_plane(blender, "Floor")
    with pytest.raises(ValueError, match="'Flor'"):
        export(objects=("Flor",))


def test_missing_uv_map(blender, export):
    add_plane(blender, "Floor")
    with pytest.raises(ValueError, match='"Floor" has no UV map named \'Radiosity\''):
        export(target="image")
    assert export(target="image", uv_map="UV").objects[0].uv.shape == (2, 3, 2)


def test_shared_mesh(blender, export):
    first = add_plane(blender, "A", uv="Radiosity")
    add_object(blender, "B", first.data)
    exported = export(target="vertex")
    assert [o.name for o in exported.objects] == ["A"]
    assert exported.skipped[0][0] == "B" and "'A'" in exported.skipped[0][1]
    assert [o.name for o in export(target="image").objects] == ["A", "B"]


def test_linked_mesh_lights_but_is_not_baked(blender, export, tmp_path):
    add_plane(blender, "Linked", material=diffuse(blender, (0.1, 0.2, 0.3)))
    path = str(tmp_path / "library.blend")
    blender.ops.wm.save_as_mainfile(filepath=path)
    blender.ops.wm.read_factory_settings(use_empty=True)
    blender.context.scene.collection.objects.link(linked(blender, path, "Linked"))
    add_plane(blender, "Local")
    exported = export()
    assert exported.scene.objects == ("Local", "Linked")
    assert exported.skipped[0][0] == "Linked" and "library" in exported.skipped[0][1]
    material = exported.scene.materials[exported.scene.material[-1]]
    np.testing.assert_allclose(material.reflectance.value, (0.1, 0.2, 0.3), rtol=1e-6)


def test_what_a_missing_library_held_is_named(blender, export, tmp_path):
    """Blender opens such a file with an empty in the object's place."""
    add_plane(blender)
    library, scene = tmp_path / "library.blend", tmp_path / "scene.blend"
    lost = blender.data.objects.new("Lost", blender.data.meshes.new("Lost"))
    blender.data.libraries.write(str(library), {lost})
    blender.data.objects.remove(lost)
    blender.context.scene.collection.objects.link(linked(blender, library, "Lost"))
    blender.ops.wm.save_as_mainfile(filepath=str(scene))
    library.unlink()
    blender.ops.wm.open_mainfile(filepath=str(scene))
    (text,) = [each for each in export().warnings if "library.blend" in each]
    assert "'Lost'" in text and "missing" in text
    (*_, (name, reason)) = export(objects=("Lost", "Plane")).skipped
    assert name == "Lost" and "library.blend" in reason
    blender.data.objects.remove(blender.data.objects["Plane"])
    with pytest.raises(Refused, match="no mesh to bake; 'Lost' is left out: .*library.blend"):
        export()


def test_ray_visibility(blender, export):
    add_plane(blender, "A").visible_shadow = False
    add_plane(blender, "B").visible_diffuse = False
    scene = export().scene
    assert scene.casts_shadow.tolist() == [False, True]
    assert scene.visible.tolist() == [True, False]


def test_canceling_passes_through_and_leaves_nothing(blender):
    from radiosity_addon.export import export_scene
    from radiosity_addon.settings import Settings

    class Canceled(Exception):
        pass

    def progress(fraction):
        raise Canceled

    add_plane(blender)
    with pytest.raises(Canceled):
        export_scene(blender.context, Settings(), progress)
    assert len(blender.data.scenes) == len(blender.data.objects) == 1
