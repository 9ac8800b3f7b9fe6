"""Materials whose fronts and backs are not alike."""

from __future__ import annotations

import numpy as np
import pytest

from tests.export.scene_building import (
    add_material,
    add_plane,
    material_of,
    surface,
)


def one_way(bpy, through_math: bool):
    """Red seen from the front, clear from behind; with a Math node, for Cycles to evaluate."""
    material, nodes, link = add_material(bpy)
    mix, red = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeBsdfDiffuse")
    red.inputs["Color"].default_value = (0.8, 0.2, 0.1, 1)
    factor = nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"]
    if through_math:
        math = nodes.new("ShaderNodeMath")
        math.operation = "POWER"
        link(factor, math.inputs[0])
        factor = math.outputs[0]
    link(factor, mix.inputs[0])
    link(red.outputs[0], mix.inputs[1])
    link(nodes.new("ShaderNodeBsdfTransparent").outputs[0], mix.inputs[2])
    surface(material, mix)
    return material


@pytest.mark.parametrize("evaluated", [False, True])
def test_each_side_has_its_own_surface(blender, export, evaluated):
    add_plane(blender, material=one_way(blender, evaluated))
    front = material_of(export())
    np.testing.assert_allclose(front.reflectance.value, (0.8, 0.2, 0.1), rtol=1e-3)
    assert not np.any(front.transmittance.value)
    np.testing.assert_allclose(front.back.transmittance.value, 1, rtol=1e-3)
    np.testing.assert_allclose(front.back.reflectance.value, 0, atol=1e-6)


def test_sides_inside_a_group(blender, export):
    """The group, which the user's other materials share, is turned in a copy."""
    group = blender.data.node_groups.new("Sides", "ShaderNodeTree")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketFloat")
    side = group.nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"]
    group.links.new(side, group.nodes.new("NodeGroupOutput").inputs[0])
    material, nodes, link = add_material(blender)
    node = surface(material, nodes.new("ShaderNodeBsdfDiffuse"))
    use = nodes.new("ShaderNodeGroup")
    use.node_tree = group
    link(use.outputs[0], node.inputs["Color"])
    add_plane(blender, material=material)
    found = material_of(export())
    np.testing.assert_allclose(found.reflectance.value, 0, atol=1e-6)
    np.testing.assert_allclose(found.back.reflectance.value, 1, rtol=1e-3)
    assert len(group.nodes) == 2 and len(blender.data.node_groups) == 1


@pytest.mark.parametrize("evaluated", [False, True])
def test_each_side_emits_for_itself(blender, export, evaluated):
    """Black in front and white behind, read or evaluated by Cycles."""
    material, nodes, link = add_material(blender, "Screen")
    node = surface(material, nodes.new("ShaderNodeEmission"))
    side = nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"]
    if evaluated:
        same = nodes.new("ShaderNodeMath")
        same.operation, same.inputs[1].default_value = "MULTIPLY", 1.0
        link(side, same.inputs[0])
        side = same.outputs[0]
    link(side, node.inputs["Color"])
    add_plane(blender, material=material)
    exported = export()
    found = material_of(exported)
    np.testing.assert_allclose(found.emission.value, 0, atol=1e-6)
    np.testing.assert_allclose(found.back.emission.value, 1, rtol=1e-3)
    assert exported.warnings == ()
