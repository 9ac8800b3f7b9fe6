"""What a bake left in the file: which objects carry it, under which names."""

from __future__ import annotations

import bpy

from ..bake.attribute import find_colors
from ..bake.image import MARK, find_baked
from ..bake.made import PASSES, passes_of
from ..bake.uv_maps import find_uv_map
from ..bake.windows import owners
from ..settings import Settings


def image_of(properties, item):
    """The image baked for ``item``, its own or an atlas', or None."""
    return find_baked(properties.bake_name, atlas_of(properties), item.name)


def atlas_of(properties) -> str | None:
    """The name of the atlas, where one is asked for."""
    return properties.atlas.strip() or None if properties.use_atlas else None


def attribute_of(properties, mesh) -> str | None:
    """The name of the mesh's baked colour attribute, or None."""
    return find_colors(mesh, properties.bake_name)


def passes_baked(properties, item) -> tuple[str, ...]:
    """The passes that the bake of ``item`` holds; empty where it was not noted."""
    if properties.target == "VERTEX":
        return passes_of(item.data, attribute_of(properties, item.data))
    return tuple(image_of(properties, item).get(PASSES, "").split(","))


def uv_map_of(properties, mesh) -> str | None:
    """The UV map that an image was baked to, or None if the mesh lacks it."""
    name = properties.uv_map.strip() or Settings().name
    if name in mesh.uv_layers:
        return name
    return find_uv_map(mesh, name)


def baked_objects(context) -> list:
    """The visible meshes that carry a result for the target that is chosen."""
    return list(_baked(context))


def any_baked(context) -> bool:
    """Whether there are any: asked at every redraw, so it looks no further than the first."""
    return next(_baked(context), None) is not None


def _baked(context):
    properties = context.scene.radiosity
    marked = {image[MARK] for image in bpy.data.images if MARK in image}
    held = {name for image in bpy.data.images if MARK in image for name in owners(image)}
    for item in context.view_layer.objects:
        if item.type != "MESH":
            continue
        own = f"{properties.bake_name}_{item.name}"
        if properties.target == "IMAGE" and item.name not in held and own not in marked:
            continue
        if has_result(item, properties) and item.visible_get():
            yield item


def has_result(item, properties) -> bool:
    """Whether ``item`` carries a bake: the attribute, or the image and its UV map."""
    if properties.target == "VERTEX":
        return attribute_of(properties, item.data) is not None
    return image_of(properties, item) is not None and uv_map_of(properties, item.data) is not None
