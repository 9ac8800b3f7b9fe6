"""The texels Cycles bakes are among ours, and all but a sliver of ours are among Cycles'."""

from __future__ import annotations

import numpy as np

from radiosity_addon.bake.clip import doubled_areas
from radiosity_addon.bake.texels import texel_receivers


def cycles_covered(blender, obj, resolution):
    """(resolution, resolution) bool: texels that a bake without margin gives a color."""
    material = blender.data.materials.new("White")
    if blender.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    emission = tree.nodes.new("ShaderNodeEmission")
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(emission.outputs[0], output.inputs[0])
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = blender.data.images.new("seen", resolution, resolution, float_buffer=True)
    tree.nodes.active = node
    obj.data.materials.append(material)
    scene = blender.context.scene
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    blender.context.view_layer.objects.active = obj
    obj.select_set(True)
    blender.ops.object.bake(type="EMIT", margin=0)
    values = np.empty(4 * resolution**2, np.float32)
    node.image.pixels.foreach_get(values)
    return values.reshape(resolution, resolution, 4)[..., 0] > 0


def test_covered_texels_agree_with_cycles(blender):
    """Cycles takes a texel whose center is covered; ours is covered wherever a part of it is."""
    uv = np.array([[(0.1, 0.05), (0.93, 0.2), (0.4, 0.97)],
                   [(0.02, 0.6), (0.2, 0.7), (0.05, 0.95)]])
    mesh = blender.data.meshes.new("Two")
    points = np.c_[uv.reshape(-1, 2), np.zeros(6)]
    mesh.from_pydata(points.tolist(), [], [(0, 1, 2), (3, 4, 5)])
    mesh.uv_layers.new(name="uv").data.foreach_set("uv", uv.astype(np.float32).ravel())
    obj = blender.data.objects.new("Two", mesh)
    blender.context.scene.collection.objects.link(obj)
    cycles = cycles_covered(blender, obj, 32)
    receivers = texel_receivers(uv, np.arange(2), 32)
    ours = np.zeros((32, 32))
    share = np.abs(doubled_areas(receivers.corners)) * np.where(receivers.square, 1.0, 0.5)
    area = share * np.abs(doubled_areas(uv))[receivers.triangle] * 32**2
    np.add.at(ours, tuple(receivers.grid[receivers.receiver, 1:].T), area)
    assert cycles.sum() > 300
    assert not (cycles & (ours == 0)).any()
    assert not (~cycles & (ours > 0.999)).any()
