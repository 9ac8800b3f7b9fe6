"""Panorama: Cycles renders what surrounds the scene.

For worlds that are more than a constant. Call inside ``traceless()``. The picture is what
diffuse rays see, so Light Path nodes in the copied world answer as for a diffuse ray.
"""

from __future__ import annotations

import os
import tempfile

import numpy as np

from .images import file_numbers
from .traceless import temporary_camera

DIFFUSE_RAY = {"Is Diffuse Ray": 1.0, "Is Reflection Ray": 1.0, "Ray Depth": 1.0,
               "Diffuse Depth": 1.0, "Ray Length": 1e5}  # fmt: skip


def world_scene(world, like):
    """A temporary empty scene lit by a copy of ``world``; (scene, copy of the world)."""
    import bpy

    scene = bpy.data.scenes.new("Radiosity temporary")
    scene.frame_current = like.frame_current
    scene.world = world.copy()
    scene.world.cycles.sampling_method = "NONE"  # no importance map: nothing is lit here
    if scene.world.node_tree is not None:
        as_diffuse_ray(scene.world.node_tree)
    scene.camera = temporary_camera(scene)
    set_up_cycles(scene)
    return scene, scene.world


def as_diffuse_ray(tree) -> None:
    """Cut Light Path nodes of a temporary tree and put a diffuse ray's answers in their place."""
    for node in [node for node in tree.nodes if node.bl_idname == "ShaderNodeLightPath"]:
        for output in node.outputs:
            for link in list(output.links):
                value = tree.nodes.new("ShaderNodeValue")
                value.outputs[0].default_value = DIFFUSE_RAY.get(output.name, 0.0)
                tree.links.new(value.outputs[0], link.to_socket)
        tree.nodes.remove(node)


def set_up_cycles(scene, samples: int = 1) -> None:
    """Plain, quiet Cycles on the processor: no denoising, no adaptive sampling, no film tricks."""
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples = samples
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.film_exposure = 1.0
    cycles.pixel_filter_type = "BOX"
    scene.render.use_compositing = scene.render.use_sequencer = False
    scene.render.film_transparent = False


def panorama(scene, width: int, samples: int, box: tuple[slice, slice] | None = None) -> np.ndarray:
    """(width / 2, width, 3) float32 radiance in the layout of ``solver.scene.Sky``; of a ``box``,
    rows and columns, that part alone."""
    camera = scene.camera
    camera.data.type = "PANO"
    owner = camera.data if hasattr(camera.data, "panorama_type") else camera.data.cycles
    owner.panorama_type = "EQUIRECTANGULAR"
    camera.rotation_euler = (np.pi / 2.0, 0.0, -np.pi / 2.0)
    if box is None:
        return render(scene, width, width // 2, samples)
    settings, (rows, columns) = scene.render, box
    settings.border_min_y, settings.border_max_y = (2 * x / width for x in (rows.start, rows.stop))
    settings.border_min_x, settings.border_max_x = (x / width for x in (columns.start, columns.stop))
    settings.use_border = settings.use_crop_to_border = True
    try:
        return render(scene, width, width // 2, samples)
    finally:
        settings.use_border = False


def close_up(scene, direction: np.ndarray, angle: float, size: int, samples: int) -> np.ndarray:
    """(size, size, 3) radiance [W/m²/sr] around ``direction`` (3,) through a square field of view [rad]."""
    from mathutils import Vector

    camera = scene.camera
    camera.data.type = "PERSP"
    camera.data.sensor_fit = "HORIZONTAL"
    camera.data.angle = angle
    camera.rotation_euler = Vector(direction).to_track_quat("-Z", "Y").to_euler()
    return render(scene, size, size, samples)


def render(scene, width: int, height: int, samples: int) -> np.ndarray:
    """Render a temporary scene to (height, width, 3) float32 linear pixels, row 0 at the bottom."""
    import bpy

    scene.cycles.samples = samples
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGB"
    if hasattr(settings, "linear_colorspace_settings") and hasattr(bpy.data, "colorspace"):
        settings.linear_colorspace_settings.name = bpy.data.colorspace.working_space
    with tempfile.TemporaryDirectory(prefix="radiosity_") as folder:
        path = os.path.join(folder, "picture.exr")
        scene.render.filepath = path
        scene.render.use_file_extension = True
        bpy.ops.render.render(scene=scene.name, write_still=True)
        return file_numbers(path)[..., :3].copy()
