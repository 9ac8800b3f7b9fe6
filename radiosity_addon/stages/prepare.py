"""Prepare: from the open file to a Job. Depends on bpy where it is called."""

from __future__ import annotations

import numpy as np

from .. import memory
from ..bake.faces import face_receivers, receiver_budget, triangle_areas
from ..bake.texels import overlapping_texels, texel_receivers
from ..bake.unwrap import ensure_uv_map, remove_uv_maps
from ..export.exported import Exported
from ..settings import Settings
from ..solver.progress import Progress, silent
from ..solver.receivers import Receivers, concatenate
from .job import Job

UV_MAP = "Radiosity"  # made where no map is named
TEXEL_BYTES = 1100  # of memory per texel of an image, as measured at 1024 and 2048 texels


def prepare(context, settings: Settings, progress: Progress = silent) -> Job:
    """Look at the open file: make missing UV maps, export, and lay out the receivers.

    Raises ValueError for a choice of objects that cannot be baked, MemoryError when the images
    asked for do not fit; then, or when stopped, the file is as it was.
    """
    settings.check()
    context.view_layer.update()  # what a script has just linked is not in its list before
    objects = _candidates(context, settings)
    _check_memory(len(objects), settings)
    made: list[tuple[str, str]] = []
    try:
        if settings.target == "image" and settings.uv_map is None:
            progress("export", 0.0)
            made = ensure_uv_map(objects, UV_MAP, settings.resolution, settings.margin)
        exported = _export(context, settings, progress)
        made = _drop_unused(made, exported.objects)
        receivers, warnings = _lay_out(exported, settings)
        warnings += _warn_of_sharing(context, exported.objects, settings)
    except BaseException:
        remove_uv_maps(made)
        raise
    return Job(
        settings=settings,
        scene=exported.scene,
        receivers=concatenate(receivers),
        spans=tuple(np.cumsum([0] + [part.count for part in receivers]).tolist()),
        targets=exported.objects,
        skipped=exported.skipped,
        made_uv_maps=tuple(made),
        warnings=(*exported.scene.warnings, *exported.warnings, *warnings),
    )


def _candidates(context, settings: Settings) -> list:
    """The meshes asked for that could get a UV map; the export may leave out some.

    Raises ValueError for a name that the view layer does not have.
    """
    found = {item.name: item for item in context.view_layer.objects}
    unknown = [name for name in settings.objects if name not in found]
    if unknown:
        raise ValueError(
            f"no object of the view layer is called {_quoted(unknown)}; "
            f"its meshes are {_quoted(_meshes(found)) or 'none'}"
        )
    names = settings.objects or [name for name, item in found.items() if not item.hide_render]
    return [
        item
        for item in (found[name] for name in names)
        if item.type == "MESH" and item.data.library is None and len(item.data.polygons)
    ]


def _meshes(found: dict) -> list[str]:
    return [name for name, item in found.items() if item.type == "MESH"]


def _quoted(names, most: int = 5) -> str:
    text = ", ".join(repr(name) for name in list(names)[:most])
    return f"{text} and {len(names) - most} more" if len(names) > most else text
def _check_memory(images: int, settings: Settings) -> None:
    if settings.target == "image":
        memory.require(
            images * settings.resolution**2 * TEXEL_BYTES,
            f"baking {images} images of {settings.resolution} x {settings.resolution} texels",
            "lower --resolution or name fewer --objects",
        )


def _export(context, settings: Settings, progress: Progress) -> Exported:
    from ..export import export_scene

    exported = export_scene(context, settings, lambda fraction: progress("export", fraction))
    if not exported.objects:
        raise ValueError("there is no mesh to bake; " + _reasons(exported.skipped))
    return exported


def _reasons(skipped) -> str:
    if not skipped:
        return "add one to the view layer, enabled in renders"
    name, reason = skipped[0]
    more = f" (and {len(skipped) - 1} more are left out)" if len(skipped) > 1 else ""
    return f"{name!r} is left out: {reason}{more}"


def _drop_unused(made, targets) -> list[tuple[str, str]]:
    """Take back the maps on meshes that the export left out; the others."""
    import bpy

    meshes = {bpy.data.objects[target.name].data for target in targets}
    unused = [pair for pair in made if bpy.data.objects[pair[0]].data not in meshes]
    remove_uv_maps(unused)
    return [pair for pair in made if pair not in unused]


def _warn_of_sharing(context, targets, settings: Settings) -> list[str]:
    """One sentence for each mesh that is a target's and other objects' too."""
    import bpy

    users: dict[str, list[str]] = {}
    for item in context.view_layer.objects:
        if item.type == "MESH":
            users.setdefault(item.data.name_full, []).append(item.name)
    meshes = dict.fromkeys(bpy.data.objects[target.name].data.name_full for target in targets)
    baked = {target.name for target in targets}
    warnings = []
    for mesh in meshes:
        if len(users.get(mesh, ())) > 1:
            first = next(name for name in users[mesh] if name in baked)
            shown = (
                "they share its UV map and materials, and have an image each"
                if settings.target == "image"
                else f"all show the colours of {first!r}"
            )
            warnings.append(f"mesh {mesh!r} is shared by {_quoted(users[mesh])}: {shown}; make "
                            "it single-user to give each its own")
    return warnings


def _lay_out(exported: Exported, settings: Settings) -> tuple[list[Receivers], list[str]]:
    """The receivers of each target, and warnings about its UV map."""
    if settings.target == "image":
        return _texels(exported, settings.resolution)
    scene = exported.scene
    areas = triangle_areas(scene.vertices, scene.triangles)
    baked = [areas[target.start : target.stop] for target in exported.objects]
    budget = receiver_budget(np.concatenate(baked))
    return [
        face_receivers(scene.vertices, scene.triangles[t.start : t.stop], _numbers(t), budget)
        for t in exported.objects
    ], []


def _texels(exported: Exported, resolution: int) -> tuple[list[Receivers], list[str]]:
    parts, warnings = [], []
    for image, target in enumerate(exported.objects):
        part = texel_receivers(target.uv, _numbers(target), resolution, image)
        shared = overlapping_texels(part, target.uv, target.start, resolution)
        if not part.count:
            warnings.append(f"{target.name!r}: its UV map covers no texel; the image is empty")
        elif shared:
            warnings.append(
                f"{target.name!r}: faces overlap in its UV map on {shared} texels, which hold "
                "their mean; bake to a map without overlaps"
            )
        parts.append(part)
    return parts, warnings


def _numbers(target) -> np.ndarray:
    return np.arange(target.start, target.stop, dtype=np.int32)


def discard(context, job: Job) -> None:
    """Take back the UV maps that prepare made, for a bake that is given up."""
    remove_uv_maps(list(job.made_uv_maps))
