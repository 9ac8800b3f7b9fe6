"""Parity cases of geometry: how things come to stand in a scene."""

from __future__ import annotations

from functools import partial

from .parity_stage import GREEN, Case, cube, glow, panel, scratch, stage
from .scene_parts import matte

BLUE = (0.1, 0.3, 0.8)
PLACES = ((-1.3, 1.0, 0.4), (1.2, 1.2, 0.7), (1.2, -1.2, 0.3))


def collection_instances():
    """A collection that is nowhere in the scene, instanced in three places."""
    import bpy

    thing, source = stage(lit=True), cube()
    hidden = bpy.data.collections.new("Hidden")
    bpy.context.scene.collection.objects.unlink(source)
    hidden.objects.link(source)
    for place in PLACES:
        empty = bpy.data.objects.new("Instance", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", hidden
        empty.location, empty.rotation_euler = place, (0.3, 0.5, place[0])
        bpy.context.scene.collection.objects.link(empty)
    return thing


def node_instances():
    """Geometry nodes put a cube on each vertex of a triangle."""
    import bpy

    thing, source = stage(lit=True), cube()
    source.hide_render = True
    mesh = bpy.data.meshes.new("Points")
    mesh.from_pydata(PLACES, [], [])
    carrier = bpy.data.objects.new("Points", mesh)
    bpy.context.scene.collection.objects.link(carrier)
    tree = bpy.data.node_groups.new("Instances", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    spread = tree.nodes.new("GeometryNodeInstanceOnPoints")
    what = tree.nodes.new("GeometryNodeObjectInfo")
    what.inputs["Object"].default_value = source
    tree.links.new(start.outputs[0], spread.inputs["Points"])
    tree.links.new(what.outputs["Geometry"], spread.inputs["Instance"])
    tree.links.new(spread.outputs[0], end.inputs[0])
    carrier.modifiers.new("Nodes", "NODES").node_group = tree
    return thing


def particles(kind: str):
    """A cube for each particle of a small sheet: hairs, or particles at rest since frame 1."""
    import bpy

    thing, source = stage(lit=True), cube(edge=0.25)
    source.hide_render = True
    sheet = panel("Sheet", [(-1.5, -1.5, 1.4), (1.2, -1.5, 1.4), (1.2, 1.2, 1.4), (-1.5, 1.2, 1.4)],
                  matte("Sheet", BLUE))  # fmt: skip
    sheet.show_instancer_for_render = False
    settings = sheet.modifiers.new("Particles", "PARTICLE_SYSTEM").particle_system.settings
    settings.type, settings.count = kind, 9
    settings.render_type, settings.instance_object = "OBJECT", source
    settings.particle_size, settings.hair_length = 1.0, 1.0
    if kind == "EMITTER":
        settings.frame_start = settings.frame_end = 1
        settings.physics_type, settings.lifetime = "NO", 100
    bpy.context.scene.frame_set(2)
    return thing


def from_library():
    """A cube linked from another file, in place and as an instanced collection."""
    import bpy

    thing, source = stage(lit=True), cube()
    source.location = PLACES[0]
    collection = bpy.data.collections.new("Assets")
    collection.objects.link(source)
    path = str(scratch() / "library.blend")
    bpy.data.libraries.write(path, {collection})
    for block in (collection, source, source.data, source.data.materials[0]):
        bpy.data.batch_remove([block])
    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        wanted.collections, wanted.objects = ["Assets"], ["Cube"]
    bpy.context.scene.collection.objects.link(wanted.objects[0])
    empty = bpy.data.objects.new("Instance", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", wanted.collections[0]
    empty.location = (2.0, -1.5, 0.2)
    bpy.context.scene.collection.objects.link(empty)
    return thing


def linked_duplicates():
    """Three objects of one mesh; one has a material of its own on the object."""
    import bpy

    thing, source = stage(lit=True), cube()
    for place in PLACES:
        copy = source.copy()
        copy.location = place
        bpy.context.scene.collection.objects.link(copy)
    copy.material_slots[0].link = "OBJECT"
    copy.material_slots[0].material = matte("Own", BLUE)
    bpy.data.objects.remove(source)
    return thing


def modifiers():
    """A cube with a bevel, repeated by an array."""
    thing, source = stage(lit=True), cube()
    source.location = (-1.2, 1.2, 0.5)
    source.modifiers.new("Bevel", "BEVEL").width = 0.1
    source.modifiers.new("Array", "ARRAY").count = 3
    return thing


def modified_stage():
    """The baked object itself, subdivided for the render only."""
    thing = stage(lit=True)
    modifier = thing.modifiers.new("Subdivision", "SUBSURF")
    modifier.subdivision_type = "SIMPLE"
    modifier.levels, modifier.render_levels = 0, 2
    return thing


def negative_scale():
    """The stage mirrored and its faces turned to look inside; the slab mirrored as well."""
    import bpy

    thing = stage(lit=True)
    thing.scale = (-1.0, 1.0, 1.0)
    thing.location = (0.3, 0.0, 0.0)
    bpy.data.objects["Slab"].scale = (1.0, 1.0, -1.2)
    bpy.data.objects["Slab"].location = (0.0, 0.0, 1.6)
    return thing


def curve(emits: bool):
    """A bent tube."""
    import bpy

    thing = stage(lit=not emits)
    data = bpy.data.curves.new("Tube", "CURVE")
    data.dimensions, data.bevel_depth = "3D", 0.15
    spline = data.splines.new("BEZIER")
    spline.bezier_points.add(1)
    for point, place in zip(spline.bezier_points, ((-1.2, -1.2, 1.6), (1.2, 0.8, 2.0))):
        point.co = place
        point.handle_left_type = point.handle_right_type = "AUTO"
    data.materials.append(glow(20.0) if emits else matte("Tube", GREEN))
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Tube", data))
    return thing


def text(emits: bool):
    """Thick letters lying above the floor."""
    import bpy

    thing = stage(lit=not emits)
    data = bpy.data.curves.new("Letters", "FONT")
    data.body, data.size, data.extrude = "LIGHT", 1.0, 0.05
    data.materials.append(glow(20.0) if emits else matte("Letters", GREEN))
    letters = bpy.data.objects.new("Letters", data)
    letters.location, letters.rotation_euler = (-1.5, -1.0, 1.5), (0.4, 0.0, 0.0)
    bpy.context.scene.collection.objects.link(letters)
    return thing


def metaball():
    """A ball of two metaballs."""
    import bpy

    thing = stage(lit=True)
    data = bpy.data.metaballs.new("Blob")
    data.render_resolution = data.resolution = 0.15
    for place in ((0.0, 0.0, 0.0), (0.5, 0.0, 0.2)):
        data.elements.new(type="BALL").co = place
    data.materials.append(matte("Blob", GREEN))
    blob = bpy.data.objects.new("Blob", data)
    blob.location = (0.9, -1.0, 0.9)
    blob.scale = (0.6, 0.6, 0.6)
    bpy.context.scene.collection.objects.link(blob)
    return thing


def extra(**settings):
    """A cube between lamp and floor with these settings of the object."""
    thing, box = stage(lit=True), cube()
    box.location = (0.9, -0.6, 1.2)
    for name, value in settings.items():
        setattr(box, name, value)
    return thing


def instancer_hidden():
    """A collection of two cubes excluded from the view layer."""
    import bpy

    thing = stage(lit=True)
    collection = bpy.data.collections.new("Excluded")
    bpy.context.scene.collection.children.link(collection)
    box = cube()
    box.location = (0.9, -0.6, 1.2)
    bpy.context.scene.collection.objects.unlink(box)
    collection.objects.link(box)
    bpy.context.view_layer.layer_collection.children["Excluded"].exclude = True
    return thing


def smooth_by_angle():
    """A cube shaded smooth but for edges sharper than 30°, which are all of its; baked itself."""
    stage(lit=True)
    box = cube("Box", 0.8)
    box.location = (0.9, -0.9, 0.9)
    box.data.shade_smooth()
    box.data.set_sharp_from_angle(angle=0.52)
    return box


def smooth_ball():
    """A coarse ball shaded smooth beside the stage."""
    import bpy

    thing = stage(lit=True)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8, radius=0.5,
                                         location=(0.9, -0.9, 0.9))  # fmt: skip
    ball = bpy.context.object
    ball.data.materials.append(matte("Ball", GREEN))
    ball.data.shade_smooth()
    return thing


CASES = (
    Case("collection instances", collection_instances),
    Case("geometry nodes instances", node_instances),
    Case("hair instances", partial(particles, "HAIR")),
    Case("particle instances", partial(particles, "EMITTER")),
    Case("linked from a library", from_library),
    Case("linked duplicates", linked_duplicates),
    Case("modifiers", modifiers),
    Case("modifiers of the stage", modified_stage),
    Case("negative scale", negative_scale),
    Case("curve", partial(curve, False)),
    Case("curve, emitting", partial(curve, True), effort=4),
    Case("text", partial(text, False)),
    Case("text, emitting", partial(text, True), effort=4),
    Case("metaballs", metaball),
    Case("hidden in renders", partial(extra, hide_render=True)),
    Case("hidden from diffuse rays", partial(extra, visible_diffuse=False)),
    Case("hidden from shadow rays", partial(extra, visible_shadow=False)),
    Case("hidden from the camera", partial(extra, visible_camera=False)),
    Case("hidden from transmission rays", partial(extra, visible_transmission=False)),
    Case("holdout", partial(extra, is_holdout=True)),
    Case("excluded collection", instancer_hidden),
    Case("smooth by angle, baked", smooth_by_angle),
    Case("smooth ball beside the stage", smooth_ball),
)
