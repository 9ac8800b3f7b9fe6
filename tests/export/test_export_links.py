"""Light and shadow linking: which objects lamps and what emits light, and which shade them."""

from __future__ import annotations

import pytest

from tests.export.lamp_formulas import add_lamp
from tests.export.scene_building import add_material, add_plane, diffuse, surface


@pytest.mark.parametrize("state, linked", [("INCLUDE", ["A"]), ("EXCLUDE", ["B"])])
@pytest.mark.parametrize(
    "collects, tells, other",
    [
        ("receiver_collection", "lamp_objects", "lamp_blockers"),
        ("blocker_collection", "lamp_blockers", "lamp_objects"),
    ],
)
def test_light_and_shadow_linking(blender, export, collects, tells, other, state, linked):
    things = [add_plane(blender, name) for name in "AB"]
    lamp = add_lamp(blender, "POINT", energy=10.0)
    collection = blender.data.collections.new("Linked")
    collection.objects.link(things[0])
    setattr(lamp.light_linking, collects, collection)
    collection.collection_objects[0].light_linking.link_state = state
    scene = export().scene
    assert [scene.objects[i] for i in getattr(scene, tells)[0]] == linked
    assert getattr(scene, other) is None and not any("shad" in w for w in scene.warnings)


def test_nothing_shades_a_lamp_without_shadow(blender, export):
    add_plane(blender)
    add_lamp(blender, "POINT", energy=10.0).data.use_shadow = False
    add_lamp(blender, "POINT", energy=10.0)
    scene = export().scene
    assert len(scene.lamp_blockers[0]) == 0 and scene.lamp_blockers[1] is None


@pytest.mark.parametrize("state, linked", [("INCLUDE", ["A"]), ("EXCLUDE", ["Dark", "Screen"])])
@pytest.mark.parametrize(
    "collects, tells, other",
    [
        ("receiver_collection", "emission_objects", "emission_blockers"),
        ("blocker_collection", "emission_blockers", "emission_objects"),
    ],
)
def test_links_of_an_emitting_object(blender, export, collects, tells, other, state, linked):
    """A dark object's links mean nothing."""
    material, nodes, _ = add_material(blender, "Glow")
    surface(material, nodes.new("ShaderNodeEmission"))
    target = add_plane(blender, "A", material=diffuse(blender))
    collection = blender.data.collections.new("Linked")
    collection.objects.link(target)
    for name, own in (("Screen", material), ("Dark", diffuse(blender))):
        thing = add_plane(blender, name, material=own)
        setattr(thing.light_linking, collects, collection)
    collection.collection_objects[0].light_linking.link_state = state
    scene = export().scene
    links = getattr(scene, tells)
    mine = links[scene.objects.index("Screen")]
    assert sorted(scene.objects[i] for i in mine) == linked
    assert sum(link is not None for link in links) == 1
    assert getattr(scene, other) is None and not any("linked" in w for w in scene.warnings)
