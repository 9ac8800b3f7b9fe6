"""Traceless: after an export the file is what it was, whatever the scene holds or goes wrong."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from tests.export.stage import add_material, add_object, add_plane, surface

BUSY = ("is_updated", "is_updated_data", "is_evaluated", "session_uid", "original", "rna_type",
        "is_updated_geometry", "is_updated_transform", "is_updated_shading",
        "storage_type")  # fmt: skip  # how Blender packs an attribute, not what it holds


def add_everything(bpy):
    """A file with a difficult material, a sky, modifiers, a text, a lamp and an instance."""
    material, nodes, link = add_material(bpy, "Noise")
    shader, noise = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeTexNoise")
    link(noise.outputs["Color"], shader.inputs["Color"])
    surface(material, shader)
    plane = add_plane(bpy, "Floor", material=material, uv="Radiosity")
    plane.modifiers.new("Levels", "SUBSURF").render_levels = 1
    add_object(bpy, "Text", bpy.data.curves.new("Text", "FONT")).data.body = "x"
    add_object(bpy, "Lamp", bpy.data.lights.new("Lamp", "POINT"))
    world = bpy.data.worlds.new("Sky")
    if not world.node_tree:
        world.use_nodes = True
    bpy.context.scene.world = world
    tree = world.node_tree
    sky = tree.nodes.new("ShaderNodeTexSky")
    tree.links.new(sky.outputs[0], tree.nodes["Background"].inputs["Color"])
    return plane


def values(block, depth=0):
    """The plain values of a data-block and of what it owns, as one nested structure."""
    result = {}
    for prop in block.bl_rna.properties:
        if prop.identifier in BUSY:
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            value = getattr(block, prop.identifier)
        if prop.type in ("BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"):
            plain = isinstance(value, (bool, int, float, str, set))
            result[prop.identifier] = value if plain else np.ravel(value).tolist()
        elif prop.type == "POINTER" and value is not None and hasattr(value, "name"):
            result[prop.identifier] = value.name
            if prop.identifier in ("node_tree", "cycles", "render") and depth < 2:
                result[prop.identifier] = values(value, depth + 1)
        elif prop.type == "COLLECTION" and depth < 3:
            items = list(value)[:200]
            deep = depth < 2
            result[prop.identifier] = [values(i, depth + 1) for i in items] if deep else len(items)
    return result


def flat(value, path=""):
    """A nested structure as {path: plain value}, whose differences can be read."""
    if isinstance(value, dict):
        pairs = value.items()
    elif isinstance(value, (list, tuple)):
        pairs = enumerate(value)
    else:
        return {path: value}
    return {k: v for key, child in pairs for k, v in flat(child, f"{path}/{key}").items()}


def snapshot(bpy):
    """Everything a user could notice: data-blocks, their values, selection, mode, handlers."""
    blocks = {}
    skip = ("screens", "workspaces", "window_managers", "brushes")
    for prop in bpy.data.bl_rna.properties:
        if prop.type == "COLLECTION" and prop.identifier not in skip:
            for block in getattr(bpy.data, prop.identifier):
                blocks[prop.identifier, block.name_full, block.users] = values(block)
    layer = bpy.context.view_layer
    state = [(o.name, o.select_get(), o.hide_get(), o.mode) for o in layer.objects]
    active = layer.objects.active
    handlers = [len(getattr(bpy.app.handlers, n)) for n in dir(bpy.app.handlers) if "render" in n]
    return flat((blocks, state, active and active.name, bpy.context.scene.name, handlers))


def differences(before, after):
    """{path: (before, after)} of what is not the same."""
    paths = before.keys() | after.keys()
    return {p: (before.get(p), after.get(p)) for p in paths if before.get(p) != after.get(p)}


@pytest.mark.parametrize("target", ["vertex", "image"])
def test_nothing_changes(blender, export, target):
    plane = add_everything(blender)
    blender.context.view_layer.objects.active = plane
    plane.select_set(True)
    blender.data.objects["Text"].hide_set(True)
    blender.context.view_layer.update()
    before = snapshot(blender)
    exported = export(target=target)
    assert len(exported.scene.lamps) == 2 and exported.scene.sky is not None
    assert differences(before, snapshot(blender)) == {}


@pytest.mark.parametrize("mode", ["EDIT", "SCULPT", "VERTEX_PAINT"])
def test_mode_stays_and_materials_are_still_evaluated(blender, export, mode):
    plane = add_everything(blender)
    blender.context.view_layer.objects.active = plane
    plane.select_set(True)
    blender.ops.object.mode_set(mode=mode)
    scene = export().scene
    assert blender.context.object == plane and plane.mode == mode
    assert hasattr(scene.materials[scene.material[0]].reflectance, "pixels")


def test_failure_leaves_nothing_either(blender, monkeypatch):
    from radiosity_addon.export import evaluated, export_scene
    from radiosity_addon.settings import Settings

    add_everything(blender)
    blender.context.view_layer.update()
    before = snapshot(blender)

    def fail(*args):
        raise OSError("no memory for the bake")

    monkeypatch.setattr(evaluated, "_bake", fail)
    with pytest.raises(OSError, match="no memory"):
        export_scene(blender.context, Settings())
    assert differences(before, snapshot(blender)) == {}


def test_an_earlier_render_stays(blender, export, tmp_path):
    scene = blender.context.scene
    add_plane(blender)
    camera = add_object(blender, "Camera", blender.data.cameras.new("Camera"))
    scene.camera = camera
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.render.resolution_x = scene.render.resolution_y = 16
    blender.ops.render.render()
    export()
    path = str(tmp_path / "render.png")
    blender.data.images["Render Result"].save_render(path)
    assert tuple(blender.data.images.load(path).size) == (16, 16)


def test_handlers_stay_silent(blender, export):
    add_plane(blender)
    calls = []
    handler = lambda *arguments: calls.append(1)  # noqa: E731
    blender.app.handlers.render_complete.append(handler)
    try:
        export()
        assert calls == [] and handler in blender.app.handlers.render_complete
    finally:
        blender.app.handlers.render_complete.remove(handler)
