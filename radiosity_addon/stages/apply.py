"""Apply: write the colors into the open file, all of them or none."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import numpy as np

from .. import memory
from ..bake.attribute import find_colors, write_colors
from ..bake.bake_notes import ATLAS, OWNER, PASSES, SCALE, note
from ..bake.encodings import decode, encode
from ..bake.image import MARK, file_names, find_baked, save_encoded, save_image, write_image
from ..bake.windows import objects_of_image
from ..files import Publication
from ..settings import Settings, Target
from ..solver.expected import Refused
from ..solver.progress import Progress, silent
from ..steps import finish
from .encode import BYTE_ENCODING, Encoding, encoding_name, encoding_of
from .job import Job, Result
from .prepare import discard
from .restore import remember_colors, remember_image
from .sheets import Sheet, sheets_of
from .spool import drop_pages


def apply(
    context, job: Job, result: Result, progress: Progress = silent,
    publication: Publication | None = None, encoding: Encoding | None = None,
) -> tuple[str, ...]:  # fmt: skip
    """Write every target's colors, and the image files asked for; returns warnings.

    The files become part of ``publication``, for the caller to commit; without one they are in
    place on return. On any failure Blender's data are put back, the UV maps that prepare made are
    removed, and the exception goes on: Refused for objects that changed meanwhile, OSError for
    files. ``encoding``: as ``encode`` gives it, found here when not given.
    """
    steps = apply_steps(context, job, result, publication, encoding)
    return finish(steps, lambda fraction: progress("Write", fraction))


def find_encoding(job: Job, result: Result) -> Encoding:
    """How the colors of a bake are encoded, with Blender's color management."""
    from ..bake.primaries import to_rec709

    return encoding_of(job, result, to_rec709())


def apply_steps(
    context, job: Job, result: Result, publication: Publication | None = None,
    encoding: Encoding | None = None,
):  # fmt: skip
    """``apply`` in steps, one for each image or object. Closed before its end, it puts all back.
    Nothing else may change the file between its steps, and no undo may come."""
    encoding = encoding or find_encoding(job, result)
    warnings: list[str] = list(encoding.warnings)
    with ExitStack() as undo, ExitStack() as own:
        undo.callback(discard, context, job)
        files = publication or own.enter_context(Publication())
        objects = _find(job)
        if job.settings.target == Target.IMAGE:
            earlier = yield from _image_steps(job, result, files, undo, warnings, encoding)
        else:
            earlier = []
            for index, item in enumerate(objects):
                yield index / len(objects)
                undo.callback(remember_colors(item, job.settings.name))
                warnings += _write_colors(job, item, result.colors[index], encoding)
                name = find_colors(item.data, job.settings.name)
                note(item.data, name, passes=job.settings.passes)
        if publication is None:
            files.commit()
        for item in objects:
            _keep_scale(job, item, encoding)
        undo.pop_all()  # nothing is undone any more
    for forget in earlier:
        forget()
    return tuple(warnings)


def _write_colors(job: Job, item, colors, encoding: Encoding) -> list[str]:
    """Colors as floats, or as what is read back from their codes: Blender finds the same codes."""
    data_type = "FLOAT_COLOR"
    if encoding.name is not None:
        data_type = "BYTE_COLOR"
        colors = decode(encode(colors, BYTE_ENCODING, encoding.scale), BYTE_ENCODING, 1.0)
    return write_colors(item, job.settings.name, colors, job.settings.domain, data_type)


def _keep_scale(job: Job, item, encoding: Encoding) -> None:
    """The scale as a custom property of the mesh, or of the image whose file is encoded."""
    owner = item.data
    if job.settings.target == Target.IMAGE:
        owner = find_baked(job.settings.name, job.settings.atlas, item.name)
    _keep_scale_on(owner, SCALE.format(job.settings.name), encoding)


def _keep_scale_on(owner, key: str, encoding: Encoding) -> None:
    if encoding.name is not None:
        owner[key] = encoding.scale
    elif key in owner:
        del owner[key]


def _image_steps(job: Job, result: Result, files, undo, warnings, encoding: Encoding):
    """Write the images and their files. Returns functions that drop the copies of the earlier images, for when all
    else has succeeded."""
    sheets = sheets_of(job)
    many = sum(sheet.size[0] * sheet.size[1] for sheet in sheets) > memory.UNDIVIDED
    paths = _file_paths(job, sheets)
    earlier = []
    for index, sheet in enumerate(sheets):
        yield index / len(sheets)
        name = image_name(job.settings, sheet.name)
        put_back, forget = remember_image(name)
        undo.callback(put_back)
        earlier.append(forget)
        image = write_image(name, result.colors[index], frees=many)
        _mark(image, job, sheet)
        if image.name != name:
            warnings.append(
                f"the image of {sheet.name!r} is called {image.name!r}: {name!r} is another image "
                "or too long; rename that, or choose another --name"
            )
        if paths[index] is not None:
            yield (index + 0.5) / len(sheets)
            _save_file(job, image, result.colors[index], files.stage(paths[index]), encoding)
        drop_pages(result.colors[index])
    earlier += _leave_others(job, sheets, undo)
    return earlier


def _leave_others(job: Job, sheets: list[Sheet], undo) -> list:
    """Take the targets off the other images of the atlas, and remove images that then hold no object. Returns
    functions that drop the copies of these images, for when all else has succeeded."""
    import bpy

    if job.settings.atlas is None:
        return []
    atlas = image_name(job.settings, job.settings.atlas)
    written = {image_name(job.settings, sheet.name) for sheet in sheets}
    baked, forgotten = {target.name for target in job.targets}, []
    for image in [i for i in bpy.data.images if i.get(ATLAS) == atlas and MARK in i]:
        left = [name for name in objects_of_image(image) if name not in baked and name in bpy.data.objects]
        if image[MARK] in written or len(left) == len(objects_of_image(image)):
            continue
        put_back, forget = remember_image(image[MARK])
        undo.callback(put_back)
        forgotten.append(forget)
        image[OWNER] = "\n".join(left)
        if not left:
            bpy.data.images.remove(image)
    return forgotten


def _mark(image, job: Job, sheet: Sheet) -> None:
    """Note on the image whom it was baked for, and which passes it holds."""
    names = {job.targets[index].name for index in sheet.targets}
    names.update(sheet.unbaked.objects if sheet.unbaked else ())
    image[OWNER], image[PASSES] = "\n".join(sorted(names)), ",".join(job.settings.passes)
    if job.settings.atlas:
        image[ATLAS] = image_name(job.settings, job.settings.atlas)
    elif ATLAS in image:
        del image[ATLAS]


def _save_file(job: Job, image, pixels, path: Path, encoding: Encoding) -> None:
    """The image's file, as Blender writes it or encoded by us in Rec.709."""
    if encoding_name(job.settings) is None:
        save_image(image, path)
        return
    from ..bake.primaries import to_rec709

    rgb = pixels[..., :3] @ to_rec709()
    save_encoded(np.dstack([rgb, pixels[..., 3]]), path, encoding.name, encoding.scale)


def _find(job: Job) -> list:
    """The targets' objects as they are now. Raises Refused for one that is gone."""
    import bpy

    objects = [bpy.data.objects.get(target.name) for target in job.targets]
    for target, item in zip(job.targets, objects):
        if item is None or item.type != "MESH":
            raise Refused(f"there is no mesh object {target.name!r} any more; bake again")
    return objects


def _file_paths(job: Job, sheets: list[Sheet]) -> list[Path | None]:
    """Where each image's file goes; None for each when none is asked for."""
    import bpy

    settings = job.settings
    if settings.target != Target.IMAGE or not settings.image_dir:
        return [None] * len(sheets)
    folder = Path(bpy.path.abspath(settings.image_dir))
    names = [image_name(settings, sheet.name) for sheet in sheets]
    return [folder / name for name in file_names(names, _file_format(settings))]


def image_name(settings: Settings, item: str) -> str:
    """What the image of the object or atlas called ``item`` is called."""
    return f"{settings.name}_{item}"


def _file_format(settings: Settings) -> str:
    return settings.format or "exr"
