"""What a bake left in the file: which objects carry it, under which names."""

from __future__ import annotations

import bpy

from ..bake.attribute import find_colors
from ..bake.image import MARK, find_image
from ..bake.made import PASSES, passes_of
from ..bake.uv_maps import find_uv_map
from ..settings import Settings


def image_of(properties, item):
    """The image baked for ``item``, or None."""
    return find_image(f"{properties.bake_name}_{item.name}")


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
    marked = {image.get(MARK) for image in bpy.data.images}
    for item in context.view_layer.objects:
        if item.type != "MESH":
            continue
        if properties.target == "IMAGE" and f"{properties.bake_name}_{item.name}" not in marked:
            continue
        if has_result(item, properties) and item.visible_get():
            yield item


def has_result(item, properties) -> bool:
    """Whether ``item`` carries a bake: the attribute, or the image and its UV map."""
    if properties.target == "VERTEX":
        return attribute_of(properties, item.data) is not None
    return image_of(properties, item) is not None and uv_map_of(properties, item.data) is not None
