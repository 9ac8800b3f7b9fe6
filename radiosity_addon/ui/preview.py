"""Materials that show the bake, one for each object, and putting them on. The user's own stay."""

import bpy

from ..bake.bake_notes import SLOT, note
from ..bake.own_materials import BEFORE, OWN, PREVIEW, is_preview, own_material
from ..solver.passes import Pass
from .results import (
    CarriesBake,
    attribute_of,
    baked_objects,
    image_of,
    passes_baked,
    stored_scale,
    uv_map_of,
)

GRAY = (0.8, 0.8, 0.8)  # color [linear] that Cycles and a bake show of a face without material


class RADIOSITY_OT_build_material(CarriesBake, bpy.types.Operator):
    """Build a material for each baked object that shows its light; where light alone was baked,
    times the base color of the object's own material. Your materials are not changed, and a bake
    looks through ours"""

    bl_idname = "radiosity.build_material"
    bl_label = "Build Preview Material"
    bl_options = {"REGISTER", "UNDO"}

    assign: bpy.props.BoolProperty(
        name="Put on Objects",
        description="Show the new material in every slot of the baked objects. Remove Bake brings "
        "your materials back",
        default=False,
    )

    def execute(self, context):
        properties, warnings = context.scene.radiosity, []
        made = {}
        for item in baked_objects(context):
            materials = build(properties, item, warnings)
            made.update((material.name, None) for material in materials)
            if self.assign and not put_on(item, materials):
                warnings.append(f"{item.name} has no material slot, and its mesh is linked")
        for text in warnings:
            self.report({"WARNING"}, text)
        if not warnings:
            first, *others = made
            self.report({"INFO"}, f"Built {first}" + (f" and {len(others)} more" if others else ""))
        return {"FINISHED"}


def build(properties, item, warnings: list[str]) -> list:
    """The materials for the slots of ``item``, those of an earlier build used again.

    One for all slots where the colors of the surface were baked too; else one for each of the
    object's own materials. ``warnings`` gets what cannot be shown.
    """
    slots = range(len(item.material_slots))
    own = [own_material(item, index) for index in slots] or [None]
    passes = passes_baked(properties, item)
    lit = Pass.COLOR not in passes and bool({Pass.DIRECT, Pass.INDIRECT} & set(passes))
    if not lit:
        material = _material(properties, item, own[0], False)
        _show(material, properties, item, None)
        return [material] * len(own)
    made: dict = {}
    for each in own:
        if each not in made:
            made[each] = _lit_material(properties, item, each, not made, warnings)
    return [made[each] for each in own]


def _lit_material(properties, item, own, first: bool, warnings: list[str]):
    """A copy of ``own`` that emits its base color times the baked light."""
    from .base_color import NoBaseColor, base_color  # not at Blender's start

    material = _material(properties, item, own, True, "" if first else own.name if own else "None")
    color = GRAY
    if own is not None:
        try:
            color = base_color(material.node_tree)
        except NoBaseColor as shader:
            warnings.append(f"{own.name}: the base color of {shader} cannot be read; the light is shown "
                        "without it")  # fmt: skip
            color = None
    _show(material, properties, item, color)
    return material


def _material(properties, item, own, copied: bool, suffix: str = ""):
    """The object's material of this suffix, made or made anew: a copy of ``own``, or empty."""
    key = f"{item.name}/{suffix}"
    earlier = next((m for m in bpy.data.materials if m.get(PREVIEW) == key), None)
    if copied and own is not None:
        material = own.copy()
        material.asset_clear()
    elif earlier is not None:
        material = earlier
    else:
        material = bpy.data.materials.new("")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True  # later versions always do
    if not copied or own is None:
        material.node_tree.nodes.clear()
    if earlier not in (None, material):
        earlier.user_remap(material)
        bpy.data.materials.remove(earlier)
    material.name = f"{properties.bake_name}_{item.name} Preview" + (suffix and f" {suffix}")
    material.use_fake_user = True
    material[PREVIEW] = key
    if own is not None:
        material[OWN] = own
    elif OWN in material:
        del material[OWN]
    return material


def _show(material, properties, item, color) -> None:
    """Make the material emit the bake of ``item``, times ``color`` if that is not None."""
    from ..export.node_math import feed, vector_math

    tree = material.node_tree
    nodes, links = tree.nodes, tree.links
    emission = nodes.new("ShaderNodeEmission")
    source = _source(nodes, links, properties, item)
    light = source.outputs["Color"]
    emission.inputs["Strength"].default_value = stored_scale(properties, item)
    if color is not None:
        light = vector_math(tree, "MULTIPLY", light, color)
    feed(tree, light, emission.inputs["Color"])
    outputs = [node for node in nodes if node.bl_idname == "ShaderNodeOutputMaterial"]
    for output in outputs or [nodes.new("ShaderNodeOutputMaterial")]:
        links.new(emission.outputs["Emission"], output.inputs["Surface"])
    x, y = (outputs[0] if outputs else emission).location
    emission.location, source.location = (x - 200, y + 200), (x - 700, y + 200)


def _source(nodes, links, properties, item):
    """The node whose Color output is the bake."""
    if properties.target == "VERTEX":
        attribute = nodes.new("ShaderNodeAttribute")
        attribute.attribute_name = attribute_of(properties, item.data)
        return attribute
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = image_of(properties, item)
    coordinates = nodes.new("ShaderNodeUVMap")
    coordinates.uv_map = uv_map_of(properties, item.data)
    links.new(coordinates.outputs["UV"], texture.inputs["Vector"])
    return texture


def put_on(item, materials) -> bool:
    """Show ``materials`` in the slots by links of the object, noting what was there; the mesh
    keeps its own. False where there is no slot and none can be made."""
    if not item.material_slots:
        if item.data.library is not None:
            return False
        item.data.materials.append(None)
        note(item.data, "", kind=SLOT)
    before = {}
    if BEFORE in item:
        before = {key: dict(entry) for key, entry in item[BEFORE].items()}
    for index, (slot, material) in enumerate(zip(item.material_slots, materials)):
        if not is_preview(slot.material):
            entry = {"link": slot.link}
            if slot.link == "OBJECT" and slot.material is not None:
                entry["material"] = slot.material
            before[str(index)] = entry
        slot.link = "OBJECT"
        slot.material = material
    if before:
        item[BEFORE] = before
    return True


CLASSES = (RADIOSITY_OT_build_material,)
