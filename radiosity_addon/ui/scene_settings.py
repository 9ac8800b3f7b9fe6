"""The settings and the report of a headless bake, kept in its file as the panel would keep them."""

from __future__ import annotations

import json
from contextlib import contextmanager

from ..settings import Settings


@contextmanager
def kept_in_scene(scene, settings: Settings, report: dict):
    """``scene`` holds both inside, for a file to be saved; afterward too where the add-on is
    registered, whose properties they are."""
    import bpy

    from . import properties

    registered = hasattr(bpy.types.Scene, "radiosity")
    if not registered:
        bpy.utils.register_class(properties.RadiositySettings)
        properties.register_properties()
    try:
        _fill(scene.radiosity, settings)
        scene.radiosity.report = json.dumps(report)
        yield
    finally:
        if not registered:
            properties.unregister_properties()
            bpy.utils.unregister_class(properties.RadiositySettings)


def _fill(properties, settings: Settings) -> None:
    """Set the panel to ``settings``. Which objects were asked for is a choice of the moment, as
    the selection is, and not kept; nor is a scale that was named, for which the panel has no
    place."""
    properties.target, properties.domain = settings.target.upper(), settings.domain.upper()
    properties.resolution, properties.margin = settings.resolution, settings.margin
    properties.height = settings.height or 0
    properties.use_atlas = settings.atlas is not None
    if settings.atlas is not None:
        properties.atlas, properties.atlas_images = settings.atlas, settings.atlas_images
        properties.density = settings.density or 0.0
    properties.unwrap = settings.unwrap.upper()
    properties.uv_map, properties.bake_name = settings.uv_map or "", settings.name
    properties.passes = {name.upper() for name in settings.passes}
    properties.quality = "CUSTOM" if settings.error is not None else settings.quality.upper()
    properties.error = settings.target_error
    properties.use_time_limit = settings.time_limit is not None
    if settings.time_limit is not None:
        properties.time_limit = settings.time_limit
    properties.write_files = settings.image_dir is not None
    if settings.image_dir is not None:
        properties.image_dir = settings.image_dir
        properties.format = (settings.format or "exr").upper()
    properties.shading_normals = settings.shading_normals
    properties.glossy_bounces = settings.glossy_bounces
    properties.byte_colors = settings.color_type == "byte"
    properties.auto_scale = settings.scale == 0
    properties.seed, properties.threads = settings.seed, settings.threads
