"""A whole bake adds what was asked for and changes nothing else in the user's file."""

from __future__ import annotations

import ast

import pytest

from tests.snapshot import add_everything, differences, settled, snapshot

IMAGE = {("images", "Radiosity_Floor")}
COLORS = {("meshes", "Floor", "attributes"), ("meshes", "Floor", "color_attributes")}
UV_MAP = {("meshes", "Floor", "attributes"), ("meshes", "Floor", "uv_layers")}


def changed(before, after) -> set[tuple]:
    """(kind, name) of data-blocks that are new or gone; (kind, name, property) of changed ones;
    whole paths of anything else."""
    known = {_block(path) for path in before}
    found = set()
    for path in differences(before, after):
        block, field = _block(path), path[len(str(_block(path))) + 4 :].split("/")[0]
        if block is None:
            found.add((path,))
        else:
            found.add((*block[:2], field) if block in known else block[:2])
    return found


def _block(path: str):
    """(kind, name, users) of the data-block that a snapshot's path lies in."""
    if not path.startswith("/0/("):
        return None
    return ast.literal_eval(path[3 : path.index(")/") + 1])


def bake(blender, **options) -> None:
    from radiosity_addon.bake_job import apply, prepare, run
    from radiosity_addon.settings import Settings

    job = prepare(blender.context, Settings(error=0.5, resolution=16, **options))
    apply(blender.context, job, run(job))


@pytest.mark.parametrize("target, own_map, expected", [
    ("vertex", "Mine", COLORS), ("image", "Radiosity", IMAGE), ("image", "Mine", IMAGE | UV_MAP),
])  # fmt: skip
def test_only_what_was_asked_for_is_new(blender, target, own_map, expected):
    """With materials that Cycles evaluates, a sky, modifiers, render settings, a selection and a
    mode of the user's own, all of which stay."""
    plane = add_everything(blender)
    plane.data.uv_layers[0].name = own_map
    blender.context.view_layer.objects.active = plane
    plane.select_set(True)
    blender.data.objects["Text"].hide_set(True)
    blender.ops.object.mode_set(mode="VERTEX_PAINT")
    blender.context.view_layer.update()
    before = settled(blender)
    bake(blender, target=target)
    assert changed(before, snapshot(blender)) == expected


def test_a_change_would_be_seen(blender):
    """One input of one node, a setting, a selection, a new data-block."""
    plane = add_everything(blender)
    before = settled(blender)
    tree = blender.data.materials["Noise"].node_tree
    tree.nodes["Noise Texture"].inputs["Scale"].default_value = 9
    blender.context.scene.cycles.samples += 1
    plane.select_set(True)
    blender.data.images.new("Other", 1, 1)
    found = changed(before, snapshot(blender))
    assert {("materials", "Noise", "node_tree"), ("scenes", "Scene", "cycles")} <= found
    assert ("images", "Other") in found and any(path[0].startswith("/1/") for path in found)
