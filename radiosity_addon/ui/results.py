"""What a bake left in the file: which objects carry it, under which names."""

from __future__ import annotations

import time

import bpy

from ..bake.attribute import find_colors
from ..bake.bake_notes import PASSES, SCALE, passes_of
from ..bake.image import MARK, find_baked
from ..bake.uv_maps import find_uv_map
from ..bake.windows import objects_of_image
from ..settings import Settings

MISSED = 5.0  # time [s] until a bake is looked for again where there was none and nothing changed


def image_of(properties, item):
    """The image baked for ``item``, its own or an atlas', or None."""
    return find_baked(properties.bake_name, atlas_of(properties), item.name)


def atlas_of(properties) -> str | None:
    """The name of the atlas, where one is asked for."""
    return properties.atlas.strip() or None if properties.use_atlas else None


def attribute_of(properties, mesh) -> str | None:
    """The name of the mesh's baked color attribute, or None."""
    return find_colors(mesh, properties.bake_name)


def stored_scale(properties, item) -> float:
    """By what stored colors are to be multiplied: byte colors may have been divided by it."""
    if properties.target == "VERTEX":
        return float(item.data.get(SCALE.format(properties.bake_name), 1.0))
    return 1.0


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


class CarriesBake:
    """The poll of operators that need something baked."""

    @classmethod
    def poll(cls, context):
        if any_baked(context):
            return True
        cls.poll_message_set("Nothing visible carries a bake of this target and name")
        return False


_found = ""  # name of the object that ``any_baked`` found last
_missed: tuple = ()  # (what was asked, when), where it found none


def any_baked(context) -> bool:
    """Whether there are any. Asked several times a redraw, so the last one found is looked at
    first, and while a window is drawn none are looked for again only after a while."""
    global _found, _missed
    properties = context.scene.radiosity
    last = context.view_layer.objects.get(_found) if _found else None
    if last is not None and last.type == "MESH" and has_result(last, properties):
        if last.visible_get():
            return True
    asked = properties.target, properties.bake_name, properties.uv_map, context.view_layer.name
    if _missed[:1] == (asked,) and time.monotonic() - _missed[1] < MISSED:
        return False
    item = next(_baked(context), None)
    _found, _missed = (item.name, ()) if item is not None else ("", (asked, time.monotonic()))
    if bpy.app.background:
        _missed = ()
    return item is not None


@bpy.app.handlers.persistent
def look_again(*_) -> None:
    """Something of the file changed."""
    global _missed
    _missed = ()


def _baked(context):
    properties = context.scene.radiosity
    items = (item for item in context.view_layer.objects if item.type == "MESH")
    if properties.target == "IMAGE":
        items = _with_image(items, properties.bake_name)
    return (item for item in items if has_result(item, properties) and item.visible_get())


def _with_image(items, name: str):
    """Those for which the bake ``name`` may have made an image: a look at all images, not one for
    each object."""
    marked, held = set(), set()
    for image in bpy.data.images:
        mark = image.get(MARK)
        if mark is not None:
            marked.add(mark)
            held.update(objects_of_image(image))
    return (item for item in items if item.name in held or f"{name}_{item.name}" in marked)


def has_result(item, properties) -> bool:
    """Whether ``item`` carries a bake: the attribute, or the image and its UV map."""
    if properties.target == "VERTEX":
        return attribute_of(properties, item.data) is not None
    return image_of(properties, item) is not None and uv_map_of(properties, item.data) is not None
