"""Images: the baked texture inside the .blend, and files of it. bpy."""

from __future__ import annotations

import os
import re
import tempfile
from itertools import chain
from pathlib import Path

import numpy as np

from .bake_notes import ATLAS, read_made
from .encodings import BITS, SRGB, encode
from .hdr import hdr_bytes
from .png import png_bytes
from .windows import objects_of_image

MARK = "radiosity_bake"  # custom property on images that we made: their full name
ENDINGS = {**dict.fromkeys(BITS, ".png"), "exr": ".exr", "hdr": ".hdr"}
RESERVED = re.compile(r"(?i)^(con|prn|aux|nul|com\d|lpt\d)(\.|$)")  # names Windows keeps
LONGEST_STEM = 180  # length [bytes] of a file's name: longer ones are cut


def write_image(name: str, pixels: np.ndarray, frees: bool = False):
    """Create or update the packed 32-bit float image ``name``; returns the bpy image. Where it
    ``frees`` memory the pixels are packed compressed, without loss, and Blender reads them when they are
    looked at.

    ``pixels`` (height, width, 4) float32, row 0 at the bottom, linear in the scene's working
    space, which is the color space Blender gives a new float image. Colors of texels with alpha
    0 are kept (alpha mode Channel Packed): the islands' margin needs them. A user's own image of
    that name is left alone; Blender then numbers ours.
    """
    height, width = pixels.shape[:2]
    image = find_image(name)
    if image is None or tuple(image.size) != (width, height):
        image = _new_image(name, width, height, replaced=image)
    image.alpha_mode = "CHANNEL_PACKED"
    image.pixels.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())
    image.update()
    if frees:
        _pack_small(image)
    else:
        image.pack()
    return image


def _pack_small(image) -> None:
    """Pack the image as a file that is compressed, which takes a third to a half of what ``pack`` makes
    of it, and drop its pixels. Raises OSError."""
    with tempfile.TemporaryDirectory(prefix="radiosity-") as folder:
        path = Path(folder) / "image.exr"
        _render_to(image, path, codec="ZIP")
        data = path.read_bytes()
    image.pack(data=data, data_len=len(data))
    image.source = "FILE"  # else the pixels are made anew, black
    image.buffers_free()


def _new_image(name: str, width: int, height: int, replaced):
    """A black image, used wherever ``replaced`` was: a packed one cannot change its size."""
    import bpy

    image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=True)
    image[MARK] = name
    image.use_fake_user = True  # else an image no material uses is lost on saving
    if replaced is not None:
        called = replaced.name
        replaced.user_remap(image)
        bpy.data.images.remove(replaced)
        image.name = called
    return image


def find_image(name: str):
    """The image that an earlier bake made under ``name``, whatever Blender calls it; or None."""
    import bpy

    called = bpy.data.images.get(name)  # ours, as a rule: found without a look at all
    for image in chain((called,) if called else (), bpy.data.images):
        if image.get(MARK) == name and image.library is None and image.is_float:
            return image
    return None


def find_baked(name: str, atlas: str | None, item: str):
    """The image of a bake called ``name`` that holds the object ``item``: the atlas' if one is
    named, or the object's own; None without."""
    import bpy

    if atlas is None:
        return find_image(f"{name}_{item}")
    for image in bpy.data.images:
        if image.get(ATLAS) == f"{name}_{atlas}" and item in objects_of_image(image):
            return find_image(image.get(MARK))
    return None


def file_names(names: list[str], file_format: str) -> list[str]:
    """A file name for each image name: safe on every system, unique also where case is ignored."""
    taken: set[str] = set()
    result = []
    for name in names:
        stem = re.sub(r'[<>:"/\\|?*\x00-\x1f]', "_", name).rstrip(". ") or "_"
        stem = stem.encode()[:LONGEST_STEM].decode(errors="ignore")
        stem = f"_{stem}" if RESERVED.match(stem) else stem
        unique, number = stem, 1
        while unique.casefold() in taken:
            unique, number = f"{stem}_{number}", number + 1
        taken.add(unique.casefold())
        result.append(unique + ENDINGS[file_format])
    return result


def save_image(image, path: str | Path) -> None:
    """Write the linear values of ``image`` to ``path`` as OpenEXR; an existing file is replaced whole.

    Raises OSError naming the path; no part of a file stays.
    """
    _write_atomically(path, "exr", lambda partial: _render_to(image, partial))


def save_encoded(pixels: np.ndarray, path: str | Path, encoding: str, scale: float) -> None:
    """Write ``pixels`` (height, width, 4) linear Rec.709 in one of the encodings: as a PNG or Radiance file.

    Alpha is kept where the encoding leaves it free. Raises as ``save_image`` does.
    """
    codes = encode(pixels[..., :3], encoding, scale)
    if codes.shape[-1] == 3:
        alpha = np.rint(np.clip(pixels[..., 3:], 0, 1) * (2 ** BITS[encoding] - 1))
        codes = np.concatenate([codes, alpha.astype(codes.dtype)], -1)
    data = hdr_bytes(codes) if encoding == "hdr" else png_bytes(codes, srgb=encoding in SRGB)

    def write(partial: Path) -> None:
        try:
            partial.write_bytes(data)
        except OSError as error:
            raise OSError(_explain(partial, error.strerror or str(error))) from error

    _write_atomically(path, encoding, write)


def _write_atomically(path: str | Path, file_format: str, write) -> None:
    """``write`` to a file beside ``path``, then put that in its place."""
    path = Path(path).absolute()
    if not path.parent.is_dir():
        raise OSError(f"folder {path.parent} does not exist; create it or choose another")
    partial = path.with_name(f".{path.stem}.partial{ENDINGS[file_format]}")
    try:
        write(partial)
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)


def _render_to(image, path: Path, codec: str = "NONE") -> None:
    """Write an image as Blender writes renders to OpenEXR. Raises OSError naming the path."""
    import bpy

    scene = bpy.data.scenes.new("radiosity save")
    try:
        _set_up(scene, codec)
        image.save_render(str(path), scene=scene)
    except RuntimeError as error:
        raise OSError(_explain(path, str(error).splitlines()[0])) from error
    finally:
        bpy.data.scenes.remove(scene)
    if not path.is_file() or path.stat().st_size == 0:
        raise OSError(_explain(path, "nothing was written"))


def _set_up(scene, codec: str) -> None:
    """Color management and file format of ``Image.save_render``."""
    scene.display_settings.display_device = "sRGB"
    view = scene.view_settings
    view.view_transform, view.exposure, view.gamma = "Standard", 0.0, 1.0
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGBA", "32"
    settings.exr_codec = codec


def _explain(path: Path, cause: str) -> str:
    return f"{path.parent} takes no image ({cause}); is the folder writable and the disk not full?"


def holds_bake() -> bool:
    """Whether the file has colors or images of a bake."""
    import bpy

    if any(MARK in image for image in bpy.data.images):
        return True
    return any("passes" in entry for mesh in bpy.data.meshes for entry in read_made(mesh).values())
