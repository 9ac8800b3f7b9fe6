"""Own materials: what a slot held before we put a material on it that shows a bake.

A bake looks through such materials: else their Emission would be taken for light, and a second
bake would return the first.
"""

from __future__ import annotations

import re

from .image import MARK

PREVIEW = "radiosity_preview"  # custom property on materials that we built: which one it is
OWN = "radiosity_own"  # on such a material: the material that it stands for
BEFORE = "radiosity_before"  # on objects: {slot: {"link", "material"}} before ours was put on
EARLIER = re.compile(r"(.+) Preview(\.\d+)?")  # names of materials built before they were marked
EARLIER_NODES = {"OUTPUT_MATERIAL", "EMISSION", "ATTRIBUTE", "TEX_IMAGE", "UVMAP"}
MOST = 8  # number [materials of ours] that stand for one another, at most


def is_preview(material) -> bool:
    """Whether we built the material to show a bake."""
    return material is not None and (PREVIEW in material or _built_earlier(material))


def own_material(item, index: int):
    """The material of slot ``index`` of an object, evaluated or not; None for an empty slot.

    Where the slot shows a preview: what it held before, or what the preview stands for.
    """
    material = item.material_slots[index].material
    if material is None or not is_preview(material.original):
        return material
    entry = (item.original.get(BEFORE) or {}).get(str(index))
    if entry is not None and entry.get("link") == "OBJECT":
        return behind(entry.get("material"))
    below = item.data.materials[index] if index < len(item.data.materials) else None
    if entry is not None or (below is not None and not is_preview(below.original)):
        return behind(below)
    return behind(material)


def behind(material):
    """What ``material`` stands for, through any previews."""
    for _ in range(MOST):
        if material is None or not is_preview(material.original):
            return material
        material = material.original.get(OWN)
    return None


def _built_earlier(material) -> bool:
    """Whether it is an Emission of a bake as version 0.1 built them, with no mark but its name."""
    match = EARLIER.fullmatch(material.name)
    if match is None or material.node_tree is None:
        return False
    nodes = {node.type: node for node in material.node_tree.nodes}
    if not nodes.keys() <= EARLIER_NODES or "EMISSION" not in nodes:
        return False
    attribute, image = nodes.get("ATTRIBUTE"), getattr(nodes.get("TEX_IMAGE"), "image", None)
    if attribute is not None:
        return attribute.attribute_name == match[1]
    return image is not None and MARK in image
