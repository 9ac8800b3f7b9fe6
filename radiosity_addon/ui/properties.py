"""The panel's properties, saved with the scene, and the Settings they stand for.

``Settings`` is the one source of defaults and limits; nothing here repeats a number of it.
"""

from __future__ import annotations

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ..settings import (
    ATLAS_IMAGES_RANGE,
    DENSITY_RANGE,
    ERROR_RANGE,
    RESOLUTION_RANGE,
    Settings,
)
from .enum_items import (
    CUSTOM,
    DOMAINS,
    FORMATS,
    PASSES,
    QUALITIES,
    SOURCES,
    TARGETS,
    UNWRAPS,
)
from .object_properties import register_object_properties, unregister_object_properties

DEFAULTS = Settings()


def _get_percent(properties) -> float:
    return 100 * typed(properties.error)


def _set_percent(properties, value: float) -> None:
    properties.error = typed(value) / 100


class RadiositySettings(bpy.types.PropertyGroup):
    """What the user asks of a bake in this scene."""

    target: EnumProperty(
        name="Target",
        description="Where the light is stored",
        items=TARGETS,
        default=DEFAULTS.target.upper(),
    )
    domain: EnumProperty(
        name="Domain",
        description="What carries a color of the attribute",
        items=DOMAINS,
        default=DEFAULTS.domain.upper(),
    )
    resolution: IntProperty(
        name="Resolution",
        description="Texels along an image's lower edge, and along the other one if it has no "
        "height of its own. Twice as many show half the detail size and cost up to four times the "
        "time and memory",
        default=DEFAULTS.resolution,
        min=RESOLUTION_RANGE[0],
        max=RESOLUTION_RANGE[1],
        subtype="PIXEL",
    )
    height: IntProperty(
        name="Height",
        description="Texels along an image's upright edge; 0: as many as along the lower one",
        default=DEFAULTS.height or 0,
        min=0,
        max=RESOLUTION_RANGE[1],
        subtype="PIXEL",
    )
    use_atlas: BoolProperty(
        name="Atlas",
        description="All baked objects share one image, or a few, in place of one image each. "
        "Baking some of them again changes their part of it alone",
    )
    atlas: StringProperty(
        name="Atlas Name",
        description="What the shared image is called after the name of the bake",
        default="Atlas",
    )
    atlas_images: IntProperty(
        name="Most Images",
        description="How many images the atlas may have. An object lies in one of them",
        default=DEFAULTS.atlas_images,
        min=ATLAS_IMAGES_RANGE[0],
        max=ATLAS_IMAGES_RANGE[1],
    )
    density: FloatProperty(
        name="Density",
        description="Texels per meter in the atlas, times the factor of each object; the images "
        "get as small as will do, and at most as large as the resolution. 0: as many as fit",
        default=DEFAULTS.density or 0.0,
        min=0.0,
        max=DENSITY_RANGE[1],
        soft_max=1000,
        step=100,
        precision=1,
    )
    unwrap: EnumProperty(
        name="Unwrap",
        description="Where the charts of a UV map that is made come from",
        items=UNWRAPS,
        default=DEFAULTS.unwrap.upper(),
    )
    uv_map: StringProperty(
        name="UV Map",
        description="The UV map to bake to, which each object must have. Empty: a map named "
        "Radiosity, made where it is missing; your other maps stay as they are",
        default=DEFAULTS.uv_map or "",
    )
    margin: IntProperty(
        name="Margin",
        description="Texels by which islands are extended, so that no seams show when the image "
        "is filtered. Costs next to nothing",
        default=DEFAULTS.margin,
        min=0,
        soft_max=64,
        max=1024,
        subtype="PIXEL",
    )
    bake_name: StringProperty(
        name="Name",
        description="Name of the color attribute, and start of the images' names",
        default=DEFAULTS.name,
    )
    objects_from: EnumProperty(
        name="Objects",
        description="Which objects get the light. Objects left out still take part in it",
        items=SOURCES,
    )
    quality: EnumProperty(
        name="Accuracy",
        description="The error you accept; the solver spends what that needs",
        items=QUALITIES,
        default=DEFAULTS.quality.upper(),
    )
    error: FloatProperty(
        name="Target Error",
        description="Accepted relative error: half of it takes about three times as long",
        default=DEFAULTS.target_error,
        min=ERROR_RANGE[0],
        max=ERROR_RANGE[1],
        soft_min=0.005,
        soft_max=0.2,
        precision=3,
        step=1,
    )
    shading_normals: BoolProperty(
        name="Shading Normals",
        description="Light counts as faces are shaded: smooth, by custom normals and, for images, "
        "by normal and bump maps. Off: as the faces lie",
        default=DEFAULTS.shading_normals,
    )
    glossy_bounces: BoolProperty(
        name="Glossy Bounces",
        description="What metals, gloss and coatings mirror goes on to other surfaces, as if these were "
        "matte. Off: it is left out, and rooms are darker",
        default=DEFAULTS.glossy_bounces,
    )
    error_percent: FloatProperty(
        name="Target Error",
        description="Accepted relative error: half of it takes about three times as long",
        get=_get_percent,
        set=_set_percent,
        min=100 * ERROR_RANGE[0],
        max=100 * ERROR_RANGE[1],
        soft_min=0.5,
        soft_max=20,
        precision=2,
        step=10,
        subtype="PERCENTAGE",
    )
    use_time_limit: BoolProperty(
        name="Time Limit",
        description="Stop refining after this time and bake the best result so far; the report "
        "says what error was reached",
    )
    time_limit: FloatProperty(
        name="Seconds",
        description="Time the solver may take",
        default=60.0,
        min=0.1,
        max=1e6,
        soft_max=3600,
        subtype="TIME_ABSOLUTE",
    )
    passes: EnumProperty(
        name="Passes",
        description="Which parts of the light are baked, in Cycles' meaning of the words",
        items=PASSES,
        options={"ENUM_FLAG"},
        default={name.upper() for name in DEFAULTS.passes},
    )
    write_files: BoolProperty(
        name="Image Files",
        description="Also write each image as a file",
    )
    image_dir: StringProperty(
        name="Folder",
        description="Folder the image files are written to; // is the folder of the .blend file",
        subtype="DIR_PATH",
        default="//",
    )
    format: EnumProperty(name="Format", description="Format of the image files", items=FORMATS)
    byte_colors: BoolProperty(
        name="Byte Colors",
        description="8 bits a channel instead of 32-bit floats: a quarter of the size; values "
        "above the scale are cut, with a warning",
    )
    auto_scale: BoolProperty(
        name="Scale to Brightest",
        description="Divide what is encoded in 8 or 16 bits by the brightest value, so that "
        "nothing is cut. The scale is a custom property of the mesh or image",
    )
    seed: IntProperty(
        name="Seed",
        description="Another seed gives another noise of the same size; the same seed gives the "
        "same result",
        default=DEFAULTS.seed,
        min=0,
    )
    threads: IntProperty(
        name="Threads",
        description="Cores the solver may use; 0 means all. Changes the time, not the result",
        default=DEFAULTS.threads,
        min=0,
        max=1024,
    )
    report: StringProperty(options={"HIDDEN"}, description="The last bake's report, as JSON")


def settings_of(properties: RadiositySettings, objects: tuple[str, ...] = ()) -> Settings:
    """The Settings that the properties stand for. Raises Refused as ``Settings.check`` does.

    ``objects``: names of the receivers when not all visible ones are.
    """
    uv_map = properties.uv_map.strip() or None
    atlas = properties.atlas if properties.use_atlas and properties.target == "IMAGE" else None
    packed = atlas is not None and uv_map is None
    to_files = properties.target == "IMAGE" and properties.write_files
    asked = {name.lower() for name in properties.passes}
    settings = Settings(
        objects=objects,
        target=properties.target.lower(),
        domain=properties.domain.lower(),
        resolution=properties.resolution,
        height=properties.height or None,
        atlas=atlas,
        atlas_images=properties.atlas_images if packed else DEFAULTS.atlas_images,
        density=(typed(properties.density) or None) if packed else None,
        unwrap=DEFAULTS.unwrap if uv_map else properties.unwrap.lower(),
        uv_map=uv_map,
        margin=properties.margin,
        image_dir=bpy.path.abspath(properties.image_dir) if to_files else None,
        format=properties.format.lower() if to_files else None,
        color_type="byte" if properties.byte_colors and properties.target == "VERTEX" else "float",
        scale=0.0 if properties.auto_scale else None,
        name=properties.bake_name,
        passes=tuple(name for name in DEFAULTS.passes if name in asked),
        quality=DEFAULTS.quality if properties.quality == CUSTOM else properties.quality.lower(),
        error=typed(properties.error) if properties.quality == CUSTOM else None,
        shading_normals=properties.shading_normals,
        glossy_bounces=properties.glossy_bounces,
        time_limit=typed(properties.time_limit) if properties.use_time_limit else None,
        seed=properties.seed,
        threads=properties.threads,
    )
    settings.check()
    return settings


def typed(value: float) -> float:
    """The number as the user typed it: Blender keeps 7 digits of it, 0.03 as 0.029999999."""
    return float(f"{value:.7g}")


def register_properties() -> None:
    bpy.types.Scene.radiosity = PointerProperty(type=RadiositySettings, name="Radiosity")
    register_object_properties()


def unregister_properties() -> None:
    unregister_object_properties()
    del bpy.types.Scene.radiosity
