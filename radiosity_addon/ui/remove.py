"""Remove Bake: takes back what bakes and previews made, all of it or a part."""

import bpy

from ..bake.bake_notes import COLOR, OWNER, SCALE, SLOT, UV_MAP, forget, names_made, read_made
from ..bake.image import MARK, holds_bake
from ..bake.own_materials import BEFORE, PREVIEW, behind, is_preview, own_material
from ..bake.windows import objects_of_image
from . import session
from .results import image_of

ITEMS = (
    ("MATERIALS", "Materials", "Take our materials off the objects and bring yours back", 1),
    ("COLORS", "Color Attributes", "Remove the color attributes that bakes made", 2),
    ("IMAGES", "Images", "Remove the baked images; files that were written stay", 4),
    ("UV_MAPS", "UV Maps", "Remove the UV maps that bakes made", 8),
)
ALL = {item[0] for item in ITEMS}


class RADIOSITY_OT_remove_bake(bpy.types.Operator):
    """Take back what was baked: the materials that show it, color attributes, images and UV maps.
    Only what was made by a bake goes"""

    bl_idname = "radiosity.remove_bake"
    bl_label = "Remove Bake"
    bl_options = {"REGISTER", "UNDO"}

    kinds: bpy.props.EnumProperty(
        name="Remove", description="What is taken back", items=ITEMS, options={"ENUM_FLAG"},
        default=ALL,
    )  # fmt: skip
    selected: bpy.props.BoolProperty(
        name="Selected Only",
        description="From the selected objects only; else from all of the file",
        default=False,
    )

    @classmethod
    def poll(cls, context):
        if session.current() is not None:
            cls.poll_message_set("A bake is running: wait for it or cancel it")
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set("Leave the current mode for Object Mode first")
            return False
        return True

    def execute(self, context):
        items = context.selected_objects if self.selected else bpy.data.objects
        items = [item for item in items if item.type == "MESH" and item.library is None]
        removed = {}
        if "MATERIALS" in self.kinds:
            removed["materials"] = remove_materials(items, not self.selected)
        if "COLORS" in self.kinds:
            removed["color attributes"] = sum(_remove_made(item.data, COLOR) for item in items)
        if "IMAGES" in self.kinds:
            removed["images"] = remove_images(context.scene.radiosity, items, not self.selected)
        if "UV_MAPS" in self.kinds:
            removed["UV maps"] = sum(_remove_made(item.data, UV_MAP) for item in items)
        found = ", ".join(f"{number} {what}" for what, number in removed.items() if number)
        if not found:
            self.report({"WARNING"}, "Nothing of a bake was found to remove")
            return {"CANCELLED"}
        if not holds_bake():
            _forget_reports()
        self.report({"INFO"}, f"Removed {found}")
        return {"FINISHED"}


def _forget_reports() -> None:
    """Drop the reports: the bakes that they describe are gone."""
    for scene in bpy.data.scenes:
        if scene.library is None and scene.radiosity.report:
            scene.radiosity.report = ""


class RADIOSITY_MT_remove(bpy.types.Menu):
    bl_label = "Remove Bake"

    def draw(self, context):
        for selected, text in ((False, "All"), (True, "All of Selected")):
            shown = self.layout.operator("radiosity.remove_bake", text=text)
            shown.selected, shown.kinds = selected, ALL
        self.layout.separator()
        for identifier, label, *_ in ITEMS:
            shown = self.layout.operator("radiosity.remove_bake", text=label)
            shown.selected, shown.kinds = False, {identifier}


def remove_materials(items, everywhere: bool) -> int:
    """Take our materials off the objects, and out of the file where nothing shows them any more
    or where ``everywhere``; how many slots and materials that were."""
    slots = sum(take_off(item) for item in items)
    owners = {item.name for item in items}
    removed = 0
    for material in [m for m in bpy.data.materials if m.library is None and is_preview(m)]:
        used = material.users > material.use_fake_user
        mine = material.get(PREVIEW, "").rpartition("/")[0] in owners
        if everywhere or (mine and not used):
            own = behind(material)
            if own is not None:
                material.user_remap(own)
            bpy.data.materials.remove(material)
            removed += 1
    return max(slots, removed)


def take_off(item) -> int:
    """Give every slot that shows a material of ours what it held before; how many did."""
    taken = 0
    for index, slot in enumerate(item.material_slots):
        if not is_preview(slot.material):
            continue
        taken += 1
        own, entry = own_material(item, index), (item.get(BEFORE) or {}).get(str(index))
        if slot.link == "OBJECT" and (entry is None or entry.get("link") == "DATA"):
            slot.material = None
            slot.link = "DATA"
        if slot.material != own:
            slot.material = own
    if BEFORE in item:
        del item[BEFORE]
    _remove_slot(item.data)
    return taken


def _remove_slot(mesh) -> None:
    """Remove the empty slot that was made to put a material on, when no object shows one there."""
    if read_made(mesh).get("", {}).get("kind") != SLOT:
        return
    users = [item for item in bpy.data.objects if item.data == mesh]
    if any(is_preview(slot.material) for item in users for slot in item.material_slots):
        return
    if list(mesh.materials) == [None]:
        mesh.materials.clear()
    forget(mesh, "")


def _remove_made(mesh, entry_type: str) -> int:
    """Remove the attributes or UV maps that bakes made on a mesh; how many. One of another file stays as it is there."""
    if mesh.library is not None:
        return 0
    names = names_made(mesh, entry_type)
    layers = mesh.uv_layers if entry_type == UV_MAP else mesh.color_attributes
    for name in names:
        layers.remove(layers[name])
        forget(mesh, name)
        if entry_type == COLOR and SCALE.format(name) in mesh:
            del mesh[SCALE.format(name)]
    return len(names)


def remove_images(properties, items, everywhere: bool) -> int:
    """Remove the images baked for the objects, or all; how many. What others share with them stays
    for those."""
    names = {item.name for item in items}
    known = {image_of(properties, item) for item in items}  # by name, as older bakes noted none
    removed, left = [], 0
    for image in [each for each in bpy.data.images if each.library is None and MARK in each]:
        others = [name for name in objects_of_image(image) if name not in names and name in bpy.data.objects]
        if everywhere or (not others and (names & {*objects_of_image(image)} or image in known)):
            removed.append(image)
        elif names & {*objects_of_image(image)}:  # an atlas stays for the rest
            image[OWNER] = "\n".join(others)
            left += 1
    bpy.data.batch_remove(removed)
    return len(removed) + left


CLASSES = (RADIOSITY_OT_remove_bake, RADIOSITY_MT_remove)
