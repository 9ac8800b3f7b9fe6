"""Apply: write the colours into the open file, all of them or none."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

from ..bake.attribute import write_colors
from ..bake.image import file_names, save_image, write_image
from ..files import Publication
from ..settings import Settings
from ..solver.progress import Progress, silent
from ..steps import finish
from .job import Job, Result
from .prepare import discard
from .restore import remember_colors, remember_image


def apply(
    context, job: Job, result: Result, progress: Progress = silent,
    publication: Publication | None = None,
) -> tuple[str, ...]:  # fmt: skip
    """Write every target's colours, and the image files asked for; returns warnings.

    The files become part of ``publication``, for the caller to commit; without one they are in
    place on return. On any failure Blender's data are put back, the UV maps that prepare made are
    removed, and the exception goes on: ValueError for objects that changed meanwhile, OSError for
    files.
    """
    steps = apply_steps(context, job, result, publication)
    return finish(steps, lambda fraction: progress("Write", fraction))


def apply_steps(context, job: Job, result: Result, publication: Publication | None = None):
    """``apply`` in steps, one for each image or object. Closed before its end, it puts all back.
    Nothing else may change the file between its steps, and no undo may come."""
    warnings: list[str] = []
    with ExitStack() as undo, ExitStack() as own:
        undo.callback(discard, context, job)
        files = publication or own.enter_context(Publication())
        objects = _find(job)
        if job.settings.target == "image":
            earlier = yield from _image_steps(job, result, objects, files, undo, warnings)
        else:
            earlier = []
            for index, item in enumerate(objects):
                yield index / len(objects)
                undo.callback(remember_colors(item, job.settings.name))
                warnings += write_colors(
                    item, job.settings.name, result.colors[index], job.settings.domain
                )
        if publication is None:
            files.commit()
        undo.pop_all()  # nothing is undone any more
    for forget in earlier:
        forget()
    return tuple(warnings)


def _image_steps(job: Job, result: Result, objects, files, undo, warnings: list[str]):
    """Images and their files; returns what forgets the earlier images when all is well."""
    paths = _file_paths(job)
    earlier = []
    for index, item in enumerate(objects):
        yield index / len(objects)
        name = image_name(job.settings, item.name)
        put_back, forget = remember_image(name)
        undo.callback(put_back)
        earlier.append(forget)
        image = write_image(name, result.colors[index])
        if image.name != name:
            warnings.append(
                f"the image of {item.name!r} is called {image.name!r}: {name!r} is another image "
                "or too long; rename that, or choose another --name"
            )
        if paths[index] is not None:
            yield (index + 0.5) / len(objects)
            save_image(image, files.stage(paths[index]), _kind(job.settings))
    return earlier


def _find(job: Job) -> list:
    """The targets' objects as they are now. Raises ValueError for one that is gone."""
    import bpy

    objects = [bpy.data.objects.get(target.name) for target in job.targets]
    for target, item in zip(job.targets, objects):
        if item is None or item.type != "MESH":
            raise ValueError(f"there is no mesh object {target.name!r} any more; bake again")
    return objects


def _file_paths(job: Job) -> list[Path | None]:
    """Where each target's image file goes; None for each when none is asked for."""
    import bpy

    settings = job.settings
    if settings.target != "image" or not settings.image_dir:
        return [None] * len(job.targets)
    folder = Path(bpy.path.abspath(settings.image_dir))
    names = [image_name(settings, target.name) for target in job.targets]
    return [folder / name for name in file_names(names, _kind(settings))]


def image_name(settings: Settings, item: str) -> str:
    """What the image of the object called ``item`` is called."""
    return f"{settings.name}_{item}"


def _kind(settings: Settings) -> str:
    return settings.format or "exr"
