"""Prepare: from the open file to a Job."""

from __future__ import annotations

import fnmatch
from dataclasses import replace

from .. import memory
from ..bake.atlas_layout import atlas_steps, check_own_maps
from ..bake.faces import most_receivers
from ..bake.rendered import Rendered
from ..bake.unwrap import kept_maps, unwrap_steps
from ..bake.uv_maps import HeldMap, give_maps, given, remove_uv_maps, take_back
from ..bake.windows import DENSITY, RESOLUTION, density_factor, own_size
from ..export.exported import Exported
from ..figures import quoted
from ..settings import Settings, Target
from ..solver.expected import Refused
from ..solver.progress import Progress, silent
from ..steps import finish
from .job import Job
from .unbaked import unbaked_texels

UV_MAP = "Radiosity"  # made where no map is named
NAMED = 5  # number [objects] that a message names, at most


def prepare(context, settings: Settings, progress: Progress = silent) -> Job:
    """Look at the open file and export it; missing UV maps are made and left on their meshes.

    Raises Refused for a choice of objects that cannot be baked, MemoryError when the images
    asked for do not fit; then, or when stopped, the file is as it was.
    """
    def report(fraction: float) -> None:
        progress("export", fraction)

    job, held = finish(prepare_steps(context.scene, context.view_layer, settings, report), report)
    give_maps(held)
    return job


def prepare_steps(scene, view_layer, settings: Settings, report=lambda fraction: None):
    """The steps of ``prepare``, which return the Job and the UV maps that were made: those are in
    the file only within a step. ``report(fraction)`` may raise during the longest one."""
    settings.check()
    view_layer.update()  # what a script has just linked is not in its list before
    settings = replace(settings, objects=matching(view_layer, settings.objects))
    names, layer = _candidates(view_layer, settings), (scene.name, view_layer.name)
    _check_images(names, settings)
    held = yield from _map_steps(view_layer, names, settings)
    exporting = _export_steps(*_find(*layer), settings, report)
    with given(held):
        fraction = next(exporting)  # all that looks at UV maps
    yield fraction
    exported = yield from exporting
    _check_triangles(exported, settings)
    held = _of_targets(held, exported.objects)
    job = Job(
        settings=settings,
        scene=exported.scene,
        targets=exported.objects,
        skipped=exported.skipped,
        made_uv_maps=tuple(each.pair for each in held if each.before is None),
        replaced_uv_maps=tuple(each for each in held if each.before is not None),
        warnings=(
            *exported.scene.warnings,
            *exported.warnings,
            *_warn_of_maps(exported.objects, settings),
            *_warn_of_properties(exported.objects, settings),
            *_warn_of_sharing(_find(*layer)[1], exported.objects, settings),
        ),
    )
    if settings.atlas and not held:
        job = replace(job, unbaked=unbaked_texels(job))
    return job, held


def _map_steps(view_layer, names: list[str], settings: Settings):
    """Steps that return the UV maps to be made or laid out anew; none where a map is named."""
    if settings.target != Target.IMAGE or settings.uv_map is not None:
        return []
    if settings.atlas is None:
        return (yield from unwrap_steps(
            names, UV_MAP, settings.size, settings.margin, settings.unwrap
        ))  # fmt: skip
    shown = Rendered(view_layer)
    names = [name for name in names if name in shown]
    every = [i.name for i in view_layer.objects if i.type == "MESH" and not i.hide_render]
    others = sorted(name for name in every if name in shown and name not in names)
    check_own_maps(names, UV_MAP)
    return (yield from atlas_steps(names, others, UV_MAP, settings))


def _export_steps(scene, view_layer, settings: Settings, report):
    from ..export.pipeline import steps

    return steps(scene, view_layer, settings, report)


def _find(scene_name: str, layer_name: str):
    """The scene and view layer of these names. Raises Refused when they are gone."""
    import bpy

    scene = bpy.data.scenes.get(scene_name)
    layer = scene.view_layers.get(layer_name) if scene else None
    if layer is None:
        raise Refused(f"view layer {layer_name!r} of {scene_name!r} is gone; bake again")
    return scene, layer


def matching(view_layer, words: tuple[str, ...]) -> tuple[str, ...]:
    """The names that ``words`` stand for: an object's own name, or a pattern (``*``, ``?``,
    ``[abc]``) of meshes' names. Words that stand for nothing are left as they are."""
    found = {item.name: item for item in view_layer.objects}
    names: dict[str, None] = {}
    for word in words:
        matches = [] if word in found else fnmatch.filter(_meshes(found), word)
        names.update(dict.fromkeys(sorted(matches) or [word]))
    return tuple(names)


def _candidates(view_layer, settings: Settings) -> list[str]:
    """Names of the meshes asked for that could get a UV map; the export may leave out some.

    Raises Refused for a name that the view layer does not have.
    """
    found = {item.name: item for item in view_layer.objects}
    unknown = [name for name in settings.objects if name not in found]
    if unknown:
        raise Refused(
            f"no object of the view layer is called {quoted(unknown, NAMED)}; "
            f"its meshes are {quoted(_meshes(found), NAMED) or 'none'}"
        )
    names = settings.objects or [name for name, item in found.items() if not item.hide_render]
    return [
        item.name
        for item in (found[name] for name in names)
        if item.type == "MESH" and item.data.library is None and len(item.data.polygons)
    ]


def _meshes(found: dict) -> list[str]:
    return [name for name, item in found.items() if item.type == "MESH"]


def _check_images(names: list[str], settings: Settings) -> None:
    """Raise MemoryError where the images asked for do not fit, with what would."""
    if settings.target != Target.IMAGE or settings.density is not None:
        return  # a density's images are known later
    import bpy

    width, height = settings.size
    sizes = [own_size(bpy.data.objects[name], settings.size) for name in names]
    if settings.atlas:
        sizes = [settings.size] * min(settings.atlas_images, len(names))
    texels = [w * h for w, h in sizes]
    memory.require(
        memory.of_images(sum(texels), max(texels, default=0), 0),
        f"baking {len(sizes)} images of {width} x {height} texels",
        _what_fits(texels, settings.resolution),
    )


def _what_fits(texels: list[int], resolution: int) -> str:
    """What to ask for in place of images of so many ``texels`` each, of this ``resolution``."""
    free, total, largest = memory.available_memory() or 0, sum(texels), max(texels, default=0)
    edge = memory.fitting_edge(resolution, free, total, largest, 0)
    share = memory.fitting_share(free, lambda s: memory.of_images(s * total, largest, 0))
    number = int(share * len(texels))
    remedies = [f"lower --resolution to {edge}"] if edge else []
    remedies += [f"name {number} of the --objects at a time"] if number else []
    return " or ".join(remedies) or "lower --resolution and name fewer --objects, or free some memory"


def _check_triangles(exported: Exported, settings: Settings) -> None:
    """Raise MemoryError where so many triangles do not fit."""
    sizes = [target.stop - target.start for target in exported.objects]
    triangles = len(exported.scene.triangles)
    if settings.target == Target.IMAGE:
        images = {each.rect.sheet or each.name: each.rect.size for each in exported.objects}
        texels = [width * height for width, height in images.values()]
        needed = memory.of_images(sum(texels), max(texels), triangles)
    else:
        needed = memory.of_a_bake(most_receivers(sizes), triangles)
    memory.require(
        needed,
        f"baking {len(sizes)} objects in a scene of {triangles} triangles",
        "name fewer --objects or simplify their meshes",
    )


def _of_targets(held: list[HeldMap], targets) -> list[HeldMap]:
    """The maps of meshes that the export kept."""
    import bpy

    objects = {item.session_uid: item for item in bpy.data.objects}
    meshes = {objects[t.identity].data for t in targets if t.identity in objects}
    return [h for h in held if h.identity in objects and objects[h.identity].data in meshes]


def _warn_of_maps(targets, settings: Settings) -> list[str]:
    """A sentence on UV maps that a bake uses although they were made in another way than is asked for."""
    if settings.target != Target.IMAGE or settings.uv_map is not None or settings.atlas is not None:
        return []
    kept = kept_maps([target.name for target in targets], UV_MAP, settings.unwrap)
    return [
        f"the UV map {UV_MAP!r} of {quoted(kept, NAMED)} is used as it is, although it was made otherwise than by unwrap "
        f"{settings.unwrap!r}; remove it to get a new one (Remove Bake: UV Maps)"
    ] if kept else []  # fmt: skip


def _warn_of_properties(targets, settings: Settings) -> list[str]:
    """Sentences on what is asked of single objects and changes nothing in this bake of images."""
    import bpy

    if settings.target != Target.IMAGE:
        return []
    items = [bpy.data.objects[target.name] for target in targets]
    sized = [item.name for item in items if settings.atlas is not None and own_size(item, (0, 0)) != (0, 0)]
    laid_out = settings.atlas is not None and settings.uv_map is None
    denser = [item.name for item in items if not laid_out and density_factor(item) != 1]
    return [
        f"{quoted(sized, NAMED)}: a resolution of its own (property {RESOLUTION}) changes nothing in an atlas; give it a "
        f"density factor (property {DENSITY}) instead"
    ] * bool(sized) + [
        f"{quoted(denser, NAMED)}: a density factor (property {DENSITY}) changes nothing without an atlas whose UV map is made "
        "by the bake"
    ] * bool(denser)


def _warn_of_sharing(view_layer, targets, settings: Settings) -> list[str]:
    """One sentence for each mesh that a target shares with other objects."""
    import bpy

    users: dict[str, list[str]] = {}
    for item in view_layer.objects:
        if item.type == "MESH":
            users.setdefault(item.data.name_full, []).append(item.name)
    things = [bpy.data.objects.get(target.name) for target in targets]
    meshes = dict.fromkeys(t.data.name_full for t in things if t is not None and t.data)
    baked = {target.name for target in targets}
    warnings = []
    for mesh in meshes:
        first = next((name for name in users.get(mesh, ()) if name in baked), None)
        if first is not None and len(users[mesh]) > 1:
            shown = (
                "they share its UV map and materials, and have an image each"
                if settings.target == Target.IMAGE and settings.atlas is None
                else f"all show the colors of {first!r}"
            )
            warnings.append(f"mesh {mesh!r} is shared by {quoted(users[mesh], NAMED)}: {shown}; make "
                            "it single-user (--single-user) to give each its own")
    return warnings


def discard(context, job: Job) -> None:
    """Take back the UV maps that prepare made or laid out anew, for a bake that is given up."""
    remove_uv_maps(list(job.made_uv_maps))
    take_back(job.replaced_uv_maps)
