"""Traceless: after an export the file is what it was, whatever the scene holds or goes wrong."""

from __future__ import annotations

import importlib
import warnings

import numpy as np
import pytest

from radiosity_addon.export import export_scene
from radiosity_addon.settings import Settings
from tests.export.stage import add_material, add_object, add_plane, surface

BUSY = ("is_updated", "is_updated_data", "is_evaluated", "session_uid", "original", "rna_type",
        "is_updated_geometry", "is_updated_transform", "is_updated_shading", "depsgraph",
        "storage_type")  # fmt: skip  # how Blender packs an attribute, not what it holds


def add_everything(bpy):
    """A file with materials that Cycles evaluates (of two sides, in a group, with a picture from
    disk), a sky, modifiers, a text, a lamp and render settings of the user's own."""
    material, nodes, link = add_material(bpy, "Noise")
    shader, noise = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeTexNoise")
    link(noise.outputs["Color"], shader.inputs["Color"])
    mix, group = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeGroup")
    group.node_tree = sides_group(bpy)
    link(group.outputs[0], mix.inputs[0])
    link(shader.outputs[0], mix.inputs[1])
    link(nodes.new("ShaderNodeBsdfTransparent").outputs[0], mix.inputs[2])
    surface(material, mix)
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
    scene = bpy.context.scene
    scene.render.engine, scene.render.resolution_x = "CYCLES", 77
    scene.render.filepath, scene.cycles.samples = "//mine", 7
    scene.render.bake.margin, scene.render.use_compositing = 3, True
    scene.frame_set(5)
    return plane


def sides_group(bpy):
    """A node group that gives 1 on backs."""
    group = bpy.data.node_groups.new("Sides", "ShaderNodeTree")
    group.interface.new_socket("Back", in_out="OUTPUT", socket_type="NodeSocketFloat")
    side = group.nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"]
    group.links.new(side, group.nodes.new("NodeGroupOutput").inputs[0])
    return group


def values(block, seen=None):
    """The plain values of a data-block and of all that it owns, as one nested structure; of what
    it points to and of what came before in it only the name."""
    seen = set() if seen is None else seen
    seen.add((block.as_pointer(), block.bl_rna.identifier))
    result = {}
    for prop in block.bl_rna.properties:
        if prop.identifier in BUSY:
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            value = getattr(block, prop.identifier)
        if prop.type == "POINTER":
            result[prop.identifier] = owned(value, seen)
        elif prop.type == "COLLECTION":
            items = list(value)
            result[prop.identifier] = [len(items), [owned(item, seen) for item in items[:200]]]
        else:
            plain = isinstance(value, (bool, int, float, str, set))
            result[prop.identifier] = value if plain else np.ravel(value).tolist()
    return result


def owned(value, seen):
    """A property's struct: its values where it is part of the block, else its name."""
    import bpy

    if value is None:
        return None
    apart = isinstance(value, bpy.types.ID) and not getattr(value, "is_embedded_data", False)
    if apart or (value.as_pointer(), value.bl_rna.identifier) in seen:
        return getattr(value, "name", "")
    return values(value, seen)


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


def settled(bpy):
    """A snapshot of values that were read before: Blender 4.5 fills some in on that occasion."""
    snapshot(bpy)
    return snapshot(bpy)


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
    before = settled(blender)
    exported = export(target=target)
    assert len(exported.scene.lamps) == 2 and exported.scene.sky is not None
    assert differences(before, snapshot(blender)) == {}


@pytest.mark.parametrize("mode", ["EDIT", "SCULPT", "VERTEX_PAINT"])
def test_mode_stays_and_materials_are_still_evaluated(blender, export, mode):
    plane = add_everything(blender)
    blender.context.view_layer.objects.active = plane
    plane.select_set(True)
    blender.context.scene.world = None  # its rendering is not what is tested
    blender.ops.object.mode_set(mode=mode)
    scene = export().scene
    assert blender.context.object == plane and plane.mode == mode
    assert hasattr(scene.materials[scene.material[0]].reflectance, "pixels")


WHERE = [("parts", "_read", 1, OSError), ("evaluated", "_bake", 3, KeyboardInterrupt),
         ("evaluated", "_bake", 6, OSError),
         ("panorama", "render", 2, KeyboardInterrupt)]  # fmt: skip


@pytest.mark.parametrize("module, function, call, error", WHERE)
def test_failure_and_interruption_leave_nothing_either(
    blender, monkeypatch, module, function, call, error
):
    """Raised after the work of a step was done, with its temporary data-blocks still there: the
    third bake is that of what passes a front, the sixth that of what passes a back."""
    room = importlib.import_module(f"radiosity_addon.export.{module}")
    work, calls = getattr(room, function), []

    def fail(*args, **options):
        result = work(*args, **options)
        calls.append(1)
        if len(calls) == call:
            raise error("in the middle")
        return result

    add_everything(blender)
    blender.context.view_layer.update()
    before = settled(blender)
    monkeypatch.setattr(room, function, fail)
    with pytest.raises(error, match="in the middle"):
        export_scene(blender.context, Settings())
    assert differences(before, snapshot(blender)) == {}


def test_cancelling_first_midway_and_last_leaves_nothing(blender):
    add_everything(blender)
    blender.context.view_layer.update()
    before = settled(blender)
    fractions = []
    export_scene(blender.context, Settings(), fractions.append)
    assert len(fractions) >= 3
    for last in (0, len(fractions) // 2, len(fractions) - 1):
        reports = iter(fractions[:last])

        def progress(fraction):
            if next(reports, None) is None:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            export_scene(blender.context, Settings(), progress)
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
