"""Shading normals as they leave Blender: smooth, custom, moved with the object, turned by maps."""

from __future__ import annotations

import numpy as np
import pytest

from tests.export.scene_building import (
    add_image,
    add_material,
    add_object,
    add_plane,
    diffuse,
    surface,
)


def add_cube(bpy, smooth=True, **placed):
    """A cube of edge 2 about its origin, of one material."""
    corners = [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
    quads = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    mesh = bpy.data.meshes.new("Cube")
    mesh.from_pydata(corners, [], quads)
    mesh.shade_smooth() if smooth else mesh.shade_flat()
    mesh.materials.append(diffuse(bpy))
    thing = add_object(bpy, "Cube", mesh)
    for name, value in placed.items():
        setattr(thing, name, value)
    return thing


def corners_and_normals(exported):
    """Positions and normals (36, 3) at the corners of the cube's triangles."""
    target, scene = exported.objects[0], exported.scene
    corners = scene.vertices[scene.triangles[target.start : target.stop]]
    return corners.reshape(-1, 3), target.normals.reshape(-1, 3).astype(float)


def test_a_smooth_cube_has_the_normals_of_its_diagonals(blender, export):
    add_cube(blender)
    corners, normals = corners_and_normals(export())
    np.testing.assert_allclose(normals, corners / np.sqrt(3), atol=1e-5)


def test_flat_faces_have_none(blender, export):
    add_cube(blender, smooth=False)
    assert export().objects[0].normals is None


def test_custom_normals_that_are_the_faces_own_are_none(blender, export):
    mesh = add_cube(blender).data
    own = [mesh.polygons[k // 4].normal for k in range(24)]
    mesh.normals_split_custom_set(own)
    assert mesh.normals_domain == "CORNER" and export().objects[0].normals is None


def test_the_option_leaves_them_out(blender, export):
    add_cube(blender)
    assert export(shading_normals=False).objects[0].normals is None


@pytest.mark.parametrize("scale", [(1, 2, 3), (-1, 2, 3), (-1, -2, -3)])
def test_normals_stay_upright_on_a_scaled_object(blender, export, scale):
    """Those of a surface scaled by s are n / s: at a corner of the cube ±1 / s. Mirrored or not
    they point outwards."""
    add_cube(blender, scale=scale, location=(5, 0, 0))
    corners, normals = corners_and_normals(export())
    expected = np.sign(corners - [5, 0, 0]) / np.abs(scale)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(normals, expected, atol=1e-5)


def test_custom_normals_are_read(blender, export):
    plane = add_plane(blender)
    plane.data.normals_split_custom_set([(0.6, 0, 0.8)] * 4)
    np.testing.assert_allclose(export().objects[0].normals.reshape(-1, 3), [(0.6, 0, 0.8)] * 6,
                               atol=1e-3)  # fmt: skip  # Blender keeps them in 16 bits


def mapped_plane(bpy, scale=(1, 1, 1)):
    """A plane whose normal map says (0.6, 0, 0.8) everywhere: toward the u axis, which is x."""
    material, nodes, link = add_material(bpy, "Mapped")
    color = np.ones((4, 4, 4))
    color[..., :3] = 0.5 + 0.5 * np.array([0.6, 0, 0.8])
    picture, turned = nodes.new("ShaderNodeTexImage"), nodes.new("ShaderNodeNormalMap")
    picture.image = add_image(bpy, color, floats=True)
    shader = surface(material, nodes.new("ShaderNodeBsdfDiffuse"))
    link(picture.outputs["Color"], turned.inputs["Color"])
    link(turned.outputs[0], shader.inputs["Normal"])
    thing = add_plane(bpy, material=material)
    thing.scale = scale
    return thing


@pytest.mark.parametrize("scale", [(1, 1, 1), (1, 1, -1)])
def test_normal_maps_turn_texels(blender, export, scale):
    """Under a mirrored object the map's normal is that of the face on its other side, up again."""
    mapped_plane(blender, scale)
    target = export(target="image", uv_map="UV", resolution=8).objects[0]
    assert target.fades and target.texel_normals.shape == (8, 8, 3)
    expected = np.array([0.6, 0, 0.8]) * scale
    np.testing.assert_allclose(
        target.texel_normals, np.broadcast_to(expected, (8, 8, 3)), atol=0.01
    )
    np.testing.assert_allclose(target.normals.reshape(-1, 3), [(0, 0, scale[2])] * 6, atol=1e-6)


def test_maps_leave_no_trace_and_can_be_left_out(blender, export):
    mapped_plane(blender)
    kinds = ("images", "materials", "meshes", "objects", "scenes")
    before = [len(getattr(blender.data, kind)) for kind in kinds]
    export(target="image", uv_map="UV", resolution=8)
    assert [len(getattr(blender.data, kind)) for kind in kinds] == before
    found = export(target="image", uv_map="UV", resolution=8, shading_normals=False).objects[0]
    assert found.texel_normals is None and found.normals is None


def test_vertex_colors_say_that_they_do_not_show_maps(blender, export):
    mapped_plane(blender)
    exported = export()
    assert exported.objects[0].texel_normals is None
    [warning] = [text for text in exported.warnings if "normal and bump maps" in text]
    assert "'Mapped'" in warning and "bake images" in warning


@pytest.mark.parametrize("method, warned", [("BUMP", False), ("BOTH", True)])
def test_displacement_is_shown_as_bump_only(blender, export, method, warned):
    material, nodes, link = add_material(blender, "Raised")
    surface(material, nodes.new("ShaderNodeBsdfDiffuse"))
    wave, raised = nodes.new("ShaderNodeTexWave"), nodes.new("ShaderNodeDisplacement")
    output = next(node for node in nodes if node.bl_idname == "ShaderNodeOutputMaterial")
    link(wave.outputs[0], raised.inputs["Height"])
    link(raised.outputs[0], output.inputs["Displacement"])
    material.displacement_method = method
    add_plane(blender, material=material)
    exported = export(target="image", uv_map="UV", resolution=8)
    assert exported.objects[0].texel_normals is not None and not exported.objects[0].fades
    assert any("displacement maps do not move" in text for text in exported.warnings) == warned


def test_shading_outlasts_what_is_buried(blender):
    """A smooth cube half sunk into a block: cutting off what is buried leaves the others shaded."""
    from radiosity_addon.settings import Settings
    from radiosity_addon.solver.lights.context import build_context
    from radiosity_addon.solver.progress import silent
    from radiosity_addon.stages.bury import open_layout
    from radiosity_addon.stages.layout import lay_out, shaded_layout
    from radiosity_addon.stages.prepare import prepare

    add_cube(blender)
    add_cube(blender, smooth=False, location=(0, 0, -1.5), scale=(2, 2, 1.5))
    job = prepare(blender.context, Settings(objects=("Cube",)))
    whole = lay_out(job, silent)
    opened = open_layout(whole, build_context(job.scene, 0, 1, silent))
    assert opened.buried is not None and opened.receivers.count < whole.receivers.count
    shading = shaded_layout(job, opened).receivers.shading
    assert len(shading.normal) == len(opened.receivers.triangle)
    np.testing.assert_allclose(np.linalg.norm(shading.normal, axis=1), 1, atol=1e-5)


def test_weighted_normals_are_read(blender, export):
    """A modifier that lets faces count by their area: at the edge of a large, level face and a small one,
    45 degrees down from it, the normals are the large one's."""
    mesh = blender.data.meshes.new("Edge")
    mesh.from_pydata([(0, 0, 0), (9, 0, 0), (9, 9, 0), (0, 9, 0), (-1, 0, -1), (-1, 9, -1)], [],
                     [(0, 1, 2, 3), (0, 3, 5, 4)])  # fmt: skip
    mesh.shade_smooth()
    mesh.materials.append(diffuse(blender))
    thing = add_object(blender, "Edge", mesh)
    plain = corners_and_normals(export())
    modifier = thing.modifiers.new("Weighted", "WEIGHTED_NORMAL")
    modifier.weight = 100  # the largest face alone
    weighted = corners_and_normals(export())
    np.testing.assert_array_equal(plain[0], weighted[0])
    edge = weighted[0][:, 0] == 0
    slanted = (-np.sin(np.pi / 8), 0, np.cos(np.pi / 8))
    np.testing.assert_allclose(plain[1][edge], [slanted] * edge.sum(), atol=1e-3)
    np.testing.assert_allclose(weighted[1][edge], [(0, 0, 1)] * edge.sum(), atol=2e-3)
