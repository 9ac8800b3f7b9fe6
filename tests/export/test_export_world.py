"""World: the sky's layout, and the irradiance of plain worlds, images and sky textures.

A tilted plane under the sky: E = Σ L cos θ dΩ over the exported pixels (dΩ = cos v dv du), plus
the suns, against Cycles' bake of the same plane.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.export.scene_building import add_image, add_plane, cycles_bake, diffuse


def directions(height, width):
    """(height, width, 3) unit directions of pixel centers, and their solid angles (height, 1)."""
    latitude = ((np.arange(height) + 0.5) / height - 0.5) * np.pi
    longitude = -((np.arange(width) + 0.5) / width - 0.5) * 2 * np.pi
    across = np.cos(latitude)[:, None]
    rays = np.stack([across * np.cos(longitude), across * np.sin(longitude),
                     np.repeat(np.sin(latitude)[:, None], width, 1)], -1)  # fmt: skip
    return rays, across * (np.pi / height) * (2 * np.pi / width)


def irradiance(scene, normal):
    """(3,) [W/m²] of the exported sky and suns on an unshadowed plane."""
    total = np.zeros(3)
    if scene.sky is not None:
        pixels = scene.sky.pixels
        rays, angle = directions(*pixels.shape[:2])
        total += np.einsum("ij,ijc->c", np.maximum(rays @ normal, 0) * angle, pixels)
    for sun in scene.lamps:
        total += sun.irradiance * max(0.0, -sun.direction @ normal)
    return total


def set_world(bpy, texture=None, strength=1.0):
    """A Background lit by a new node of this type, or by its own color."""
    world = bpy.data.worlds.new("World")
    if not world.node_tree:
        world.use_nodes = True
    bpy.context.scene.world = world
    tree = world.node_tree
    background = tree.nodes["Background"]
    background.inputs["Strength"].default_value = strength
    if texture is None:
        return world, background
    node = tree.nodes.new(texture)
    tree.links.new(node.outputs[0], background.inputs["Color"])
    return world, node


def tilted_plane(bpy):
    plane = add_plane(bpy, material=diffuse(bpy, (1, 1, 1)))
    plane.rotation_euler = (0.5, 0.2, 0.1)
    bpy.context.view_layer.update()
    return plane, np.array(plane.matrix_world.to_3x3()) @ (0, 0, 1)


def test_black_and_missing_worlds(blender, export):
    add_plane(blender)
    assert export().scene.sky is None
    _, background = set_world(blender, strength=0.0)
    assert export().scene.sky is None
    background.inputs["Strength"].default_value = 2.0
    background.inputs["Color"].default_value = (0.1, 0.2, 0.3, 1)
    pixels = export().scene.sky.pixels
    assert pixels.shape == (1, 1, 3)
    np.testing.assert_allclose(pixels[0, 0], (0.2, 0.4, 0.6), rtol=1e-6)


def test_world_without_nodes(blender, export):
    """Its color is its radiance."""
    world = blender.data.worlds.new("Plain")
    if blender.app.version >= (5, 0):
        pytest.skip("worlds of this Blender always have nodes")
    world.use_nodes, world.color = False, (0.1, 0.2, 0.3)
    blender.context.scene.world = world
    add_plane(blender)
    exported = export()
    np.testing.assert_allclose(exported.scene.sky.pixels[0, 0], (0.1, 0.2, 0.3), rtol=1e-6)
    assert any('world "Plain" has no nodes' in w for w in exported.warnings)


@pytest.mark.parametrize("part", ["nodes", "links"])
def test_world_with_an_empty_tree_is_black_and_named(blender, export, part):
    world, _ = set_world(blender)
    getattr(world.node_tree, part).clear()
    add_plane(blender)
    exported = export()
    assert exported.scene.sky is None
    assert any('world "World" has no shader linked' in w for w in exported.warnings)


def test_cyclic_world_is_named(blender, export):
    """Two Mix nodes feed each other, of which Blender marks one link invalid. What Cycles makes of
    the rest depends on its version; it is finite."""
    add_plane(blender)
    world, first = set_world(blender, "ShaderNodeMixRGB")
    second, link = world.node_tree.nodes.new("ShaderNodeMixRGB"), world.node_tree.links.new
    link(first.outputs[0], second.inputs[1])
    link(second.outputs[0], first.inputs[2])
    exported = export()
    assert any('world "World": links that form a cycle' in w for w in exported.warnings)
    sky = exported.scene.sky
    assert sky is None or np.isfinite(sky.pixels).all()


def test_world_hidden_from_diffuse_rays(blender, export):
    add_plane(blender)
    world, _ = set_world(blender)
    world.cycles_visibility.diffuse = False
    assert export().scene.sky is None


def test_layout_of_the_panorama(blender, export):
    """A world whose color is its own direction, plus one."""
    add_plane(blender)
    world, node = set_world(blender, "ShaderNodeVectorMath")
    node.operation, node.inputs[1].default_value = "ADD", (1, 1, 1)
    place = world.node_tree.nodes.new("ShaderNodeTexCoord")
    world.node_tree.links.new(place.outputs["Generated"], node.inputs[0])
    pixels = export().scene.sky.pixels
    rays, _ = directions(*pixels.shape[:2])
    # Random places within a pixel of 2π/512: half of that at most.
    np.testing.assert_allclose(pixels - 1, rays, atol=np.pi / pixels.shape[1] * 1.5)


@pytest.mark.parametrize("rotation", [0.0, 0.7])
def test_environment_image(blender, export, rotation):
    plane, normal = tilted_plane(blender)
    world, node = set_world(blender, "ShaderNodeTexEnvironment")
    pixels = np.ones((32, 64, 4))
    pixels[..., :3] = np.random.default_rng(4).random((32, 64, 3))
    pixels[24, 20, :3] = (300, 200, 100)  # a small sun
    node.image = add_image(blender, pixels, floats=True)
    nodes, link = world.node_tree.nodes, world.node_tree.links.new
    place, turn = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeMapping")
    turn.inputs["Rotation"].default_value = (0, 0, rotation)
    link(place.outputs["Generated"], turn.inputs["Vector"])
    link(turn.outputs[0], node.inputs["Vector"])
    ours = irradiance(export().scene, normal)
    # Four texels of 1024 samples scatter by 0.3 % between seeds.
    theirs = cycles_bake(blender, plane, size=2, samples=1024).mean(axis=(0, 1)) * np.pi
    np.testing.assert_allclose(ours, theirs, rtol=0.01)


@pytest.mark.parametrize(("width", "height_of_sun"), [(1024, 60), (512, 38)])
def test_a_sun_of_one_texel_keeps_its_light(blender, export, width, height_of_sun):
    """Between texels' middles it is as steep as a tent: by the few samples of other pixels it was 3.5 % too dark."""
    add_plane(blender)
    row = (90 + height_of_sun) * width // 360
    pixels = np.zeros((width // 2, width, 4), np.float32)
    pixels[row, int(0.62 * width), :3] = 3e5
    _, node = set_world(blender, "ShaderNodeTexEnvironment")
    node.image = add_image(blender, pixels, floats=True)
    latitude = ((row + 0.5) * 2 / width - 0.5) * np.pi
    exact = 3e5 * (2 * np.pi / width) ** 2 * np.cos(latitude) * np.sin(latitude)
    np.testing.assert_allclose(irradiance(export().scene, np.array([0, 0, 1.0])), exact, rtol=2e-3)


@pytest.mark.parametrize("elevation", [0.6, 0.002])
def test_sky_texture_with_sun(blender, export, elevation):
    plane, normal = tilted_plane(blender)
    _, node = set_world(blender, "ShaderNodeTexSky", strength=0.1)
    kinds = node.bl_rna.properties["sky_type"].enum_items.keys()
    node.sky_type = "NISHITA" if "NISHITA" in kinds else "SINGLE_SCATTERING"
    node.sun_elevation, node.sun_rotation = elevation, 0.7
    scene = export().scene
    assert len(scene.lamps) == 1 and scene.lamps[0].angle == pytest.approx(node.sun_size)
    toward = (np.cos(elevation) * np.sin(0.7), np.cos(elevation) * np.cos(0.7), np.sin(elevation))
    if elevation > 0.1:
        np.testing.assert_allclose(-scene.lamps[0].direction, toward, atol=1e-4)
    theirs = cycles_bake(blender, plane, size=2, samples=1024).mean(axis=(0, 1)) * np.pi
    np.testing.assert_allclose(irradiance(scene, normal), theirs, rtol=0.01)


def test_camera_background_is_not_the_light(blender, export):
    add_plane(blender)
    world, _ = set_world(blender)
    nodes, link = world.node_tree.nodes, world.node_tree.links.new
    path, mix = nodes.new("ShaderNodeLightPath"), nodes.new("ShaderNodeMixShader")
    seen, light = nodes["Background"], nodes.new("ShaderNodeBackground")
    seen.inputs["Color"].default_value = (9, 9, 9, 1)
    light.inputs["Color"].default_value = (0.25, 0.5, 1, 1)
    link(path.outputs["Is Camera Ray"], mix.inputs[0])
    link(light.outputs[0], mix.inputs[1])
    link(seen.outputs[0], mix.inputs[2])
    link(mix.outputs[0], nodes["World Output"].inputs["Surface"])
    np.testing.assert_allclose(export().scene.sky.pixels[0, 0], (0.25, 0.5, 1), rtol=1e-5)


@pytest.mark.parametrize("strength", [float("inf"), float("nan"), -1.0])
@pytest.mark.parametrize("texture", [None, "ShaderNodeTexGradient"])
def test_a_world_that_no_light_can_be_is_named(blender, export, texture, strength):
    """Blender keeps infinity as 3.4e38. All of the sky is that bright, or a part of it; Cycles drops
    what is not a number, so that the node is named."""
    add_plane(blender)
    set_world(blender, texture, strength)
    exported = export()
    (told,) = [w for w in exported.warnings if w.startswith('world "World"')]
    assert "not a number" in told and "above 1e+37" in told
    assert ("Strength of node Background" in told) == (strength != -1.0)
    sky = exported.scene.sky
    assert sky is None or np.all((sky.pixels >= 0) & (sky.pixels < 1e37))


@pytest.mark.parametrize("exists", [False, True])
def test_missing_and_unreadable_environments_warn(blender, export, tmp_path, exists):
    add_plane(blender)
    _, node = set_world(blender, "ShaderNodeTexEnvironment")
    image = blender.data.images.new("Lost", 4, 4)
    image.source, image.filepath = "FILE", str(tmp_path / "lost.hdr")
    if exists:
        (tmp_path / "lost.hdr").write_bytes(b"#?RADIANCE\nno picture")
    node.image = image
    exported = export()
    np.testing.assert_allclose(exported.scene.sky.pixels[0, 0], (1, 0, 1), atol=1e-5)
    assert any('"Lost"' in w and '"World"' in w for w in exported.warnings)
