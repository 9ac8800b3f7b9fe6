"""How scene-linear light looks on the display: Blender's own color management as a table. bpy.

Blender hands its view transforms (AgX, Filmic, looks, curves, white balance) to no add-on, but it
saves images as renders through them. So colors from black to ``2 ** LAST`` on a grid of three
axes are saved once for each change of the settings, and the graphics card interpolates. Exposure
only multiplies before that; the table is for exposure 0 and stays when it changes.
"""

from __future__ import annotations

import os
import tempfile

import numpy as np

# Levels [stops] of the darkest and the brightest color of the grid but for black.
FIRST, LAST = -10, 6
STEPS = 4  # number [grid points of a stop]: one lies at 1, where the Standard view cuts off
SIZE = 2 + (LAST - FIRST) * STEPS  # number [grid points of an axis]: the first is black
PLAIN = ("view_transform", "look", "gamma", "use_white_balance", "white_balance_temperature",
         "white_balance_tint", "use_curve_mapping")  # fmt: skip


def view_of(scene) -> tuple:
    """What the table is made of: equal as long as the display shows colors alike."""
    view = scene.view_settings
    plain = tuple((name, getattr(view, name)) for name in PLAIN if hasattr(view, name))
    curves = ()
    if view.use_curve_mapping:
        curves = tuple(
            tuple((*point.location, point.handle_type) for point in curve.points)
            for curve in view.curve_mapping.curves
        )
    return scene.display_settings.display_device, plain, curves


def levels() -> np.ndarray:
    """(SIZE,) scene-linear values of the grid points of an axis."""
    return np.concatenate([[0.0], 2.0 ** np.linspace(FIRST, LAST, SIZE - 1)])


def table_of(view: tuple) -> np.ndarray:
    """(SIZE, SIZE², 4) float32 as displayed, 0 to 1: the row is green's place, the column
    ``SIZE`` times blue's plus red's."""
    import bpy

    from ..export.images import file_numbers

    axis = levels().astype(np.float32)
    pixels = np.ones((SIZE, SIZE, SIZE, 4), np.float32)  # green, blue, red
    pixels[..., 0], pixels[..., 1], pixels[..., 2] = axis, axis[:, None, None], axis[:, None]
    image = bpy.data.images.new("radiosity view", SIZE**2, SIZE, alpha=True, float_buffer=True)
    scene = bpy.data.scenes.new("radiosity view")
    try:
        image.alpha_mode = "CHANNEL_PACKED"
        image.pixels.foreach_set(pixels.ravel())
        _set_up(scene, view)
        with tempfile.TemporaryDirectory(prefix="radiosity_") as folder:
            path = os.path.join(folder, "view.png")
            image.save_render(path, scene=scene)
            return file_numbers(path)
    finally:
        bpy.data.scenes.remove(scene)
        bpy.data.images.remove(image)


def _set_up(scene, view: tuple) -> None:
    """The view's settings, and a format of 16 bits a channel."""
    device, plain, curves = view
    scene.display_settings.display_device = device
    for name, value in plain:
        setattr(scene.view_settings, name, value)
    scene.view_settings.exposure = 0.0
    if curves:
        _set_curves(scene.view_settings.curve_mapping, curves)
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "PNG", "RGB", "16"
    settings.compression = 0


def _set_curves(mapping, curves: tuple) -> None:
    for curve, points in zip(mapping.curves, curves):
        while len(curve.points) < len(points):
            curve.points.new(0.5, 0.5)
        for point, (x, y, handle) in zip(curve.points, points):
            point.location, point.handle_type = (x, y), handle
    mapping.update()
