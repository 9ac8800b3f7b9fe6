"""What a bake is about to change in Blender, kept so that it can be put back.

Each function looks before the change and returns a function that undoes it. Colors are undone by
name, so it does no harm to undo a change that never came.
"""

from __future__ import annotations

from typing import Callable

import numpy as np

from ..bake.attribute import FALLBACK
from ..bake.bake_notes import MADE
from ..bake.image import MARK, find_image

Undo = Callable[[], None]


def remember_colors(item, name: str) -> Undo:
    """The color attributes that a bake called ``name`` may write on the mesh of ``item``."""
    mesh = item.data
    names = (name, FALLBACK.format(name))
    kept = [_copy_attribute(mesh, each) for each in names]
    layers = mesh.color_attributes
    active = layers.active_color.name if layers.active_color else None
    rendered = layers[layers.render_color_index].name if len(layers) else None
    made = mesh.get(MADE)

    def undo() -> None:
        if made is not None:
            mesh[MADE] = made
        elif MADE in mesh:
            del mesh[MADE]
        for each, copy in zip(names, kept):
            _put_attribute(mesh, each, copy)
        if active is not None:
            mesh.color_attributes.active_color = mesh.color_attributes[active]
        if rendered is not None:
            mesh.color_attributes.render_color_index = mesh.color_attributes.find(rendered)

    return undo


def _copy_attribute(mesh, name: str):
    """(type, domain, values) of a color attribute, or None where there is none."""
    attribute = mesh.color_attributes.get(name)
    if attribute is None:
        return None
    values = np.empty(4 * len(attribute.data), np.float32)
    attribute.data.foreach_get("color", values)
    return attribute.data_type, attribute.domain, values


def _put_attribute(mesh, name: str, copy) -> None:
    """Make the color attribute what ``copy`` says; an unchanged kind keeps its place."""
    present = mesh.color_attributes.get(name)
    if present is not None and (copy is None or copy[:2] != (present.data_type, present.domain)):
        mesh.color_attributes.remove(present)
        present = None
    if copy is None:
        return
    data_type, domain, values = copy
    if present is None:
        mesh.color_attributes.new(name=name, type=data_type, domain=domain)
    data = mesh.color_attributes[name].data
    if len(data) * 4 == len(values):  # in Edit Mode the mesh has no values to keep
        data.foreach_set("color", values)
        mesh.update()


def remember_image(name: str) -> tuple[Undo, Undo]:
    """The image an earlier bake made under ``name``: (undo, forget), one of which to call.

    The earlier image is kept as a second data-block until then.
    """
    import bpy

    earlier = find_image(name)
    if earlier is None:
        return lambda: _remove_image(find_image(name)), lambda: None
    called, kept = earlier.name, earlier.copy()
    del kept[MARK]

    def undo() -> None:
        present = find_image(name)
        if present is not None:
            present.user_remap(kept)
            bpy.data.images.remove(present)
        kept.name, kept[MARK], kept.use_fake_user = called, name, True

    return undo, lambda: _remove_image(kept)


def _remove_image(image) -> None:
    import bpy

    if image is not None:
        bpy.data.images.remove(image)
