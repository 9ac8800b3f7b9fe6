"""Parity cases of links: which objects lamps and what glows light, and which shade them."""

from __future__ import annotations

from functools import partial

from .parity_stage import Case, ceiling, cube, glow, lamp, stage


def _link_slab(thing, which: str, state: str) -> None:
    """Link ``thing`` by its collection ``which`` to the slab alone, or to all but it."""
    import bpy

    collection = bpy.data.collections.new("Linked")
    collection.objects.link(bpy.data.objects["Slab"])
    setattr(thing.light_linking, which, collection)
    collection.collection_objects[0].light_linking.link_state = state


def light_linking(state: str):
    """A second lamp that lights only the slab, or all but it."""
    thing = stage(lit=True)
    lit = lamp("POINT", (-1.0, -1.5, 1.8), energy=150.0, shadow_soft_size=0.1)
    _link_slab(lit, "receiver_collection", state)
    return thing


def shadow_linking(state: str):
    """A lamp for which, of a slab and a cube, only the slab casts a shadow, or all but the slab."""
    thing, box = stage(), cube()
    box.location = (0.9, -0.6, 1.2)
    lit = lamp("POINT", (-0.5, -0.5, 2.5), energy=150.0, shadow_soft_size=0.1)
    _link_slab(lit, "blocker_collection", state)
    return thing


def glowing_link(which: str, state: str):
    """A glowing panel linked by its collection ``which`` to the slab, or to all but it; a lamp
    lights all."""
    thing = stage()
    lamp("POINT", (-1.0, -1.5, 1.8), energy=50.0, shadow_soft_size=0.1)
    _link_slab(ceiling(glow(4.0)), which, state)
    return thing


def shadowless():
    """A lamp for which nothing casts a shadow."""
    thing = stage()
    lamp("POINT", (-0.5, -0.5, 2.5), energy=150.0, shadow_soft_size=0.1, use_shadow=False)
    return thing


CASES = (
    Case("light linking, only the slab", partial(light_linking, "INCLUDE")),
    Case("light linking, all but the slab", partial(light_linking, "EXCLUDE")),
    Case("shadow linking, only the slab", partial(shadow_linking, "INCLUDE")),
    Case("shadow linking, all but the slab", partial(shadow_linking, "EXCLUDE")),
    Case("lamp without shadow", shadowless),
    Case("emission linked to the slab", partial(glowing_link, "receiver_collection", "INCLUDE")),
    Case("emission linked to all but the slab", partial(
        glowing_link, "receiver_collection", "EXCLUDE")),
    Case("emission shaded by the slab only", partial(
        glowing_link, "blocker_collection", "INCLUDE")),
    Case("emission shaded by all but the slab", partial(
        glowing_link, "blocker_collection", "EXCLUDE")),
)
