"""Targets: which objects get colors, and why others do not."""

from __future__ import annotations

from ..bake.layers import FARTHEST
from ..settings import Target
from ..solver.expected import Refused
from .parts import Part

NOT_RENDERED = "is not visible in renders"
NOT_MESH = "its type is {type}; meshes alone are baked"
MISSING = (
    "its data is missing: it is linked from {path}, a file that is not there or no longer contains it; "
    "find it by File > External Data > Find Missing Files"
)
CONVERTIBLE = ("CURVE", "SURFACE", "META", "FONT")  # types of objects that Blender makes meshes of
LINKED = (
    "its mesh is linked from a library and cannot get a color attribute; make it local "
    "(Object > Relations > Make Local > All)"
)
LINKED_UV = (
    "its mesh is linked from a library and has no UV map {name!r}; make it local "
    "(Object > Relations > Make Local > All)"
)
SHARED = (
    "shares its mesh with {first!r}, whose colors it shows; make its mesh single-user "
    "(--single-user)"
)
SHARED_UV = (
    "shares its mesh, and so its UVs, with {first!r}, whose part of the atlas it shows; make its mesh "
    "single-user (--single-user)"
)
NO_FACES = "has no faces with area when it is rendered"
NO_NUMBERS = f"the vertices of its faces are NaN, infinite or beyond {FARTHEST:g} when it is rendered"
NO_UV = 'object "{object}" has no UV map named {name!r}; unwrap it or name another map'
UNTRACED = (
    "its modifiers make faces that cannot be traced back to its own; apply them or bake an image"
)
LOST_UV = "its modifiers drop the UV map {name!r}"


def choose_objects(view_layer, names: tuple[str, ...]) -> list:
    """The objects asked for, sorted by name; every mesh when none is named.

    Raises Refused for names that are not in the view layer, or when there is no mesh at all.
    """
    if not names:
        chosen = [item for item in view_layer.objects if item.type == "MESH"]
        if not chosen:
            lost = [(item.name, reason) for item in view_layer.objects if (reason := _missing(item))]
            raise Refused("there is no mesh to bake; " + why_none(lost))
        return sorted(chosen, key=lambda item: item.name)
    missing = [name for name in names if name not in view_layer.objects]
    if missing:
        raise Refused(
            f"no object named {', '.join(map(repr, missing))} in view layer {view_layer.name!r}; "
            "check the spelling and that its collection is not excluded"
        )
    return [view_layer.objects[name] for name in sorted(set(names))]


def why_none(skipped) -> str:
    """What to do where nothing is left to be baked: the first (name, reason), and how many more."""
    if not skipped:
        return (
            "add one to the view layer, enabled in renders; what a collection instance shows can be "
            "baked once it is real (Object > Apply > Make Instances Real)"
        )
    name, reason = skipped[0]
    more = f" (and {len(skipped) - 1} more are left out)" if len(skipped) > 1 else ""
    return f"{name!r} is left out: {reason}{more}"


def own_parts(parts: list[Part]) -> dict[str, int]:
    """Object name -> index of the part that is the object's own mesh."""
    found: dict[str, int] = {}
    for index, part in enumerate(parts):
        if not part.instance:
            found.setdefault(part.name, index)
    return found


def sort_out(items, parts: list[Part], seen: set[str], settings):
    """Split the chosen objects into receivers (list) and skipped [(name, reason)].

    ``seen`` names the objects that renders show; others are left out silently when the settings
    do not name them and there are receivers. Raises Refused when an object lacks the UV map to bake to.
    """
    own, users = own_parts(parts), {}
    receivers, skipped = [], []
    for item in items:
        if item.name not in seen and not settings.objects:
            continue
        reason = _refusal(item, own, seen, settings)
        if reason is None and (settings.target == Target.VERTEX or settings.atlas):
            first = users.setdefault(item.data.as_pointer(), item.name)
            text = SHARED if settings.target == Target.VERTEX else SHARED_UV
            reason = None if first == item.name else text.format(first=first)
        if reason is None:
            reason = _check_uv(item, parts[own[item.name]], settings)
        if reason is None:
            receivers.append(item)
        else:
            skipped.append((item.name, reason))
    if not receivers and not skipped:
        skipped = [(item.name, NOT_RENDERED) for item in items]
    return receivers, skipped


def _refusal(item, own, seen, settings) -> str | None:
    """Why an object gets no colors; None where it does."""
    if (reason := _missing(item)) is not None:
        return reason
    if item.type != "MESH":
        convert = ": convert it to one" if item.type in CONVERTIBLE else ""
        return NOT_MESH.format(type=item.type.lower().replace("_", " ")) + convert
    if item.name not in own:
        return NO_FACES if item.name in seen else NOT_RENDERED
    if settings.target == Target.VERTEX and (item.data.library or item.data.override_library):
        return LINKED
    return None


def _missing(item) -> str | None:
    """That an object, or its mesh, is linked from where it no longer is; None where it is there."""
    lost = next((each for each in (item, item.data) if each and each.is_missing and each.library), None)
    return None if lost is None else MISSING.format(path=lost.library.filepath)


def uv_map_name(item, settings) -> str:
    """The UV map to bake to: the one named, or ours, made under ``Radiosity UV`` where something
    else, like a baked color attribute, holds the name ``Radiosity``."""
    names = (settings.uv_map,) if settings.uv_map else ("Radiosity", "Radiosity UV")
    return next((name for name in names if name in item.data.uv_layers), names[0])


def _check_uv(item, part: Part, settings) -> str | None:
    """Why an object gets no image, for lack of its UV map; None where it does. Raises Refused for a
    map that was never there."""
    if settings.target != Target.IMAGE:
        return None
    name = uv_map_name(item, settings)
    if name not in item.data.uv_layers:
        if item.data.library:
            return LINKED_UV.format(name=name)
        raise Refused(NO_UV.format(object=item.name, name=name))
    return None if name in part.mesh.uvs else LOST_UV.format(name=name)
