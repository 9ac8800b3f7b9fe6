"""Which objects are baked, and why the Bake button is gray."""

from itertools import islice

import bpy
from bpy.app.translations import pgettext_tip as tip_

from ..bake.rendered import Rendered
from ..bake.single_user import sharing
from . import session
from .results import uv_map_of

LOOKED_AT = 100  # number [meshes] whose UV map is looked for at every redraw: a bake looks for all


def chosen_objects(context, properties) -> tuple[str, ...]:
    """Names of the receivers; empty for all that are rendered, as ``Settings`` has it."""
    if properties.objects_from == "ALL":
        return ()
    return tuple(item.name for item in context.selected_objects if item.type == "MESH")


def survey(context) -> list[tuple]:
    """(object, why it cannot be baked, empty when it can) for all that the user's choice points
    at, by name. The same rules as the export's, which asks the evaluated scene."""
    properties = context.scene.radiosity
    rendered = Rendered(context.view_layer)
    first: dict[str, str] = {}  # mesh: the object that gets its colors
    found = []
    for item in sorted(_pointed_at(context), key=lambda item: item.name):
        reason = _left_out(item, properties, rendered)
        if not reason and (properties.target == "VERTEX" or properties.use_atlas):
            user = first.setdefault(item.data.name_full, item.name)
            if user != item.name:
                reason = tip_("it shares its mesh with {}, whose colors it shows").format(user)
        found.append((item, reason))
    return found


def _pointed_at(context):
    if context.scene.radiosity.objects_from == "SELECTED":
        return iter(context.selected_objects)
    return (item for item in context.view_layer.objects if item.type == "MESH")


def _baked(context):
    """Those of the survey that can be baked, one after the other and without its sorting."""
    properties, rendered = context.scene.radiosity, Rendered(context.view_layer)
    return (item for item in _pointed_at(context) if not _left_out(item, properties, rendered))


def sharing_objects(context) -> list:
    """The chosen objects that get no colors of their own while they share a mesh."""
    rendered, properties = Rendered(context.view_layer), context.scene.radiosity
    chosen = [i for i in _pointed_at(context) if i.type == "MESH" and i.data.users > 1]
    return sharing(item for item in chosen if not _left_out(item, properties, rendered))


def _left_out(item, properties, rendered: Rendered) -> str:
    """Why an object cannot be baked; empty where it can."""
    if item.type != "MESH":
        return tip_("it is no mesh: convert it to one")
    if item.hide_render or item.name not in rendered:
        return tip_("it is disabled in renders")
    instanced = item.parent is not None and item.parent.instance_type in ("VERTS", "FACES")
    if instanced or (item.is_instancer and not item.show_instancer_for_render):
        return tip_("only its instances are rendered")
    if not item.data.polygons and not item.data.is_editmode:
        return tip_("it has no faces")
    if properties.target == "VERTEX" and (item.data.library or item.data.override_library):
        return tip_("its mesh is linked from another file: Object > Relations > Make Local > All")
    if properties.target == "IMAGE" and item.data.library and not uv_map_of(properties, item.data):
        return tip_("its mesh is linked and lacks the UV map: Object > Relations > Make Local > All")
    return ""


def _without_map(context, name: str):
    """The first object to be baked that lacks the UV map, or None. The map is looked for first, as
    most have it: whether an object can be baked is a longer question."""
    properties, rendered = context.scene.radiosity, Rendered(context.view_layer)
    meshes = (item for item in _pointed_at(context) if item.type == "MESH")
    lacking = (i for i in islice(meshes, LOOKED_AT) if name not in i.data.uv_layers)
    return next((item for item in lacking if not _left_out(item, properties, rendered)), None)


def why_not(context) -> str:
    """Why a bake cannot start now; empty when it can. Cheap: asked at every redraw."""
    if session.current() is not None:
        return tip_("A bake is running: wait for it or cancel it")
    if context.mode != "OBJECT":
        return tip_("Leave the current mode for Object Mode first")
    properties = context.scene.radiosity
    if not properties.passes:
        return tip_("Choose at least one pass")
    if not properties.bake_name.strip():
        return tip_("Give the color attribute and the images a name")
    if properties.target == "IMAGE" and properties.use_atlas and not properties.atlas.strip():
        return tip_("Give the atlas a name")
    if properties.write_files and properties.target == "IMAGE":
        if properties.image_dir.startswith("//") and not bpy.data.filepath:
            return tip_("Save the file first: the image folder is relative to it")
    name = properties.uv_map.strip()
    if name and properties.target == "IMAGE":
        item = _without_map(context, name)
        if item is not None:
            text = tip_("{} has no UV map {}: unwrap it, or name another map or none")
            return text.format(item.name, name)
    if next(_baked(context), None) is not None:
        return ""
    return _why_none(context, properties)


def _why_none(context, properties) -> str:
    """Why none of the chosen objects can be baked: the first mesh's reason, where there is one."""
    item = next((item for item in _pointed_at(context) if item.type == "MESH"), None)
    if item is not None:
        reason = _left_out(item, properties, Rendered(context.view_layer))
        return tip_("{} cannot be baked: {}").format(item.name, reason)
    if properties.objects_from == "SELECTED":
        return tip_("Select a mesh that is rendered")
    return tip_("Add a mesh: the view layer has none that can be baked")
