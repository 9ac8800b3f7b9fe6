"""What a bake left in the file: which objects carry it, under which names. Depends on bpy."""

import bpy


def image_name(properties, item) -> str:
    """The name of the image baked for ``item``."""
    return f"{properties.bake_name}_{item.name}"


def uv_map_name(properties, mesh) -> str | None:
    """The UV map that the image was baked to, or None if the mesh lacks it."""
    name = properties.uv_map.strip() or properties.bl_rna.properties["bake_name"].default
    return name if name in mesh.uv_layers else None


def baked_objects(context) -> list:
    """The visible meshes that carry a result for the target that is chosen."""
    properties = context.scene.radiosity
    return [
        item
        for item in context.view_layer.objects
        if item.type == "MESH" and item.visible_get() and has_result(item, properties)
    ]


def has_result(item, properties) -> bool:
    """Whether ``item`` carries a bake: the attribute, or the image and its UV map."""
    if properties.target == "VERTEX":
        return properties.bake_name in item.data.color_attributes
    found = bpy.data.images.get(image_name(properties, item))
    return found is not None and uv_map_name(properties, item.data) is not None
