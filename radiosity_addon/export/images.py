"""Images: pixels in the linear working space.

``Image.pixels`` converts nothing: an 8-bit image hands out its encoded bytes, a float image is
linear already. Cycles multiplies an 8-bit image's color by its alpha unless the node's Alpha
output is in use; it paints a missing image (1, 0, 1).
"""

from __future__ import annotations

import numpy as np

from .colors import NotSimple

MISSING = (1.0, 0.0, 1.0)  # color [linear] that Cycles shows for an image it cannot read
DATA_SPACES = ("Non-Color", "Raw")
LINEAR_SPACES = ("Linear Rec.709", "Linear", "scene_linear")


def is_missing(image) -> bool:
    """Whether Blender cannot read the image."""
    return not image.has_data and (image.size[0] == 0 or image.size[1] == 0 or not _touch(image))


def _touch(image) -> bool:
    """Ask for the pixels, which loads the file; whether there are any."""
    return len(image.pixels) > 0


def read_pixels(image, alpha_used: bool, rec709: bool) -> tuple[np.ndarray, np.ndarray, bool]:
    """Color (height, width, 3) and alpha (height, width), float32, row 0 at the bottom; and
    whether the color is sRGB-encoded still.

    Raises NotSimple for color spaces and image kinds that Cycles has to decode.
    """
    if image.source not in ("FILE", "GENERATED") or image.size[0] * image.size[1] == 0:
        raise NotSimple(f"image source {image.source}")
    if image.channels not in (3, 4):
        raise NotSimple(f"{image.channels} channels")
    width, height = image.size
    values = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(values)
    values = values.reshape(height, width, image.channels)
    color = np.ascontiguousarray(values[..., :3])  # fields share it
    if image.channels == 4 and image.alpha_mode != "NONE":
        alpha = values[..., 3]
        color = _associate(color, alpha, image, alpha_used)
    else:
        alpha = np.ones((height, width), np.float32)
    return color, alpha, _encoded(image, rec709)


def file_numbers(path: str) -> np.ndarray:
    """(height, width, channels) float32 of an image file: its numbers as they are, row 0 at the bottom."""
    import bpy

    image = bpy.data.images.load(path)
    try:
        image.colorspace_settings.name = "Non-Color"
        width, height = image.size
        values = np.empty(width * height * image.channels, np.float32)
        image.pixels.foreach_get(values)
        return values.reshape(height, width, image.channels)
    finally:
        bpy.data.images.remove(image)


def _associate(color, alpha, image, alpha_used: bool) -> np.ndarray:
    """Alpha as Cycles' image node treats it, which is before 8-bit colors are decoded.

    Raises NotSimple for transparent float and premultiplied images: what Cycles makes of these
    depends on the file type, on packing and on the version.
    """
    data = image.colorspace_settings.name in DATA_SPACES
    if data or image.alpha_mode == "CHANNEL_PACKED" or np.all(alpha == 1.0):
        return color
    if image.is_float or image.alpha_mode != "STRAIGHT":
        raise NotSimple("a transparent image that is no plain 8-bit one")
    return color if alpha_used else color * alpha[..., None]


def _encoded(image, rec709: bool) -> bool:
    """Whether pixels are sRGB-encoded; else they are linear. Raises NotSimple for other spaces."""
    space = image.colorspace_settings.name
    if space in DATA_SPACES:
        return False
    if not rec709:
        raise NotSimple("an image with colors in a working space other than Rec.709")
    if image.is_float or space in LINEAR_SPACES:
        return False
    if space == "sRGB":
        return True
    raise NotSimple(f"color space {space}")


def working_space_is_rec709() -> bool:
    """Whether the file's linear working space has Rec.709 primaries."""
    import bpy

    space = getattr(bpy.data, "colorspace", None)
    return space is None or space.working_space == "Linear Rec.709"
