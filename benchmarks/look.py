"""Bake a study scene and look at it from where a person would stand.

    python -m benchmarks.look living_room --error 0.03 --size 1024 --output picture.png

The picture shows only the baked colors: every face emits them, nothing is lit.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from .our_bake import our_bake, warm_up
from .scenes import SCENES, build

# camera, what it looks at, horizontal field of view [rad]
VIEWS = {
    "cornell": ((0, -3.8, 1), (0, 0, 1), 0.95),
    "window_room": ((1.6, -2.2, 1.7), (-0.8, 1.5, 1.0), 1.3),
    "lamp_hall": ((1.5, 1.5, 1.8), (14, 14, 2.2), 1.3),
    "street": ((0.5, -4.0, 2.0), (-0.5, 30, 5), 1.3),
    "furnace": ((0.2, -0.95, 0.1), (0, 0, 0), 1.2),
    "living_room": ((2.5, 1.5, 1.8), (-2, -2, 0.9), 1.3),
    "room": ((0, -4.7, 2), (0, 3, 2.2), 1.3),
}


def show(obj, pixels: np.ndarray) -> None:
    """Give every face of ``obj`` a material that emits the baked (size, size, 3) pixels."""
    import bpy

    from .scene_parts import emitter

    size = len(pixels)
    image = bpy.data.images.new("Baked light", size, size, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    opaque = np.concatenate([pixels, np.ones((size, size, 1))], axis=2)
    image.pixels.foreach_set(opaque.astype(np.float32).ravel())
    material = emitter("Baked light", (1.0, 1.0, 1.0), 1.0)
    tree = material.node_tree
    texture, uv = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeUVMap")
    texture.image, uv.uv_map = image, "Radiosity"
    shader = next(node for node in tree.nodes if node.type == "EMISSION")
    tree.links.new(uv.outputs[0], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], shader.inputs["Color"])
    for slot in obj.material_slots:
        slot.material = material


def picture(
    name: str, path: Path, width: int = 960, exposure: float = 0.0, samples: int = 16,
    bounces: int = 0, seed: int = 0,
) -> None:
    """Render the open scene from the view of that name; without ``bounces`` there is no light but
    what is emitted."""
    import bpy
    from mathutils import Vector

    place, target, angle = VIEWS[name]
    scene = bpy.context.scene
    data = bpy.data.cameras.new("View")
    data.angle, data.clip_start = angle, 0.01
    camera = bpy.data.objects.new("View", data)
    camera.location = place
    direction = Vector(target) - Vector(place)
    camera.rotation_euler = direction.to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.engine, cycles = "CYCLES", scene.cycles
    cycles.samples, cycles.seed, cycles.use_denoising = samples, seed, False
    cycles.max_bounces = cycles.diffuse_bounces = bounces
    cycles.use_adaptive_sampling, cycles.sample_clamp_indirect = False, 0.0
    scene.view_settings.view_transform, scene.view_settings.exposure = "Standard", exposure
    scene.render.resolution_x, scene.render.resolution_y = width, width * 5 // 8
    settings = scene.render.image_settings
    settings.file_format = "JPEG" if path.suffix == ".jpg" else "PNG"
    settings.quality = 92  # of a JPEG
    scene.render.use_stamp_filename = False  # or the file would name this machine's folders
    scene.render.filepath = str(path.resolve())
    bpy.ops.render.render(write_still=True)


def main(arguments=None) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.look", description=__doc__)
    parser.add_argument("scene", choices=list(SCENES))
    parser.add_argument("--error", type=float, default=0.03)
    parser.add_argument("--size", type=int, default=1024)
    parser.add_argument("--exposure", type=float, default=0.0, help="stops")
    parser.add_argument("--output", type=Path, required=True)
    chosen = parser.parse_args(arguments)
    warm_up()
    obj = build(SCENES[chosen.scene])
    bake = our_bake(obj, chosen.size, chosen.error)
    print(f"{chosen.scene}: {bake.seconds:.2f} s, estimated {bake.statistics.estimated_error:.4f}")
    show(obj, bake.pixels)
    picture(chosen.scene, chosen.output, exposure=chosen.exposure)


if __name__ == "__main__":
    main()
