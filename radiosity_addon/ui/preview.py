"""An explicit button that builds materials which show the bake. The user's own stay as they are."""

import bpy

from .results import attribute_of, baked_objects, image_of, uv_map_of


class RADIOSITY_OT_build_material(bpy.types.Operator):
    """Build a material that shows the baked light as it is: one for a color attribute, one per
    object for images. Your materials are not changed"""

    bl_idname = "radiosity.build_material"
    bl_label = "Build Preview Material"
    bl_options = {"REGISTER", "UNDO"}

    assign: bpy.props.BoolProperty(
        name="Put on Objects",
        description="Show the new material in every slot of the baked objects. Their meshes keep "
        "your materials: set a slot's link back to Data to see them again",
        default=False,
    )

    @classmethod
    def poll(cls, context):
        if not baked_objects(context):
            cls.poll_message_set("Nothing visible carries a bake of this target and name")
            return False
        return True

    def execute(self, context):
        properties = context.scene.radiosity
        made = {}
        for item in baked_objects(context):
            name = result_name(properties, item)
            if name not in made:
                made[name] = build(name, properties, item)
            if self.assign:
                put_on(item, made[name])
        names = ", ".join(material.name for material in made.values())
        self.report({"INFO"}, names)
        return {"FINISHED"}


def result_name(properties, item) -> str:
    """The name of the attribute or image that shows the bake of ``item``."""
    if properties.target == "VERTEX":
        return attribute_of(properties, item.data)
    return image_of(properties, item).name


def build(name: str, properties, item):
    """A new material whose Emission shader shows ``name``, the bake of ``item``."""
    material = bpy.data.materials.new(f"{name} Preview")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True  # later versions always do
    material.use_fake_user = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    output = nodes.new("ShaderNodeOutputMaterial")
    emission = nodes.new("ShaderNodeEmission")
    source = _source(nodes, links, name, properties, item)
    emission.location, source.location = (-200, 0), (-500, 0)
    links.new(source.outputs["Color"], emission.inputs["Color"])
    links.new(emission.outputs["Emission"], output.inputs["Surface"])
    return material


def _source(nodes, links, name, properties, item):
    """The node whose Color output is the bake."""
    if properties.target == "VERTEX":
        attribute = nodes.new("ShaderNodeAttribute")
        attribute.attribute_name = name
        return attribute
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = image_of(properties, item)
    coordinates = nodes.new("ShaderNodeUVMap")
    coordinates.uv_map = uv_map_of(properties, item.data)
    coordinates.location = (-700, 0)
    links.new(coordinates.outputs["UV"], texture.inputs["Vector"])
    return texture


def put_on(item, material) -> None:
    """Show ``material`` in every slot by a link of the object; the mesh keeps its own."""
    if not item.material_slots:
        item.data.materials.append(None)
    for slot in item.material_slots:
        slot.link = "OBJECT"
        slot.material = material


CLASSES = (RADIOSITY_OT_build_material,)
