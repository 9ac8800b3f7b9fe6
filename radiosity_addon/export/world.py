"""World: what lights the scene from infinitely far.

A constant becomes one pixel. Everything else is rendered by Cycles to a panorama. The disk of a
sky texture's sun is far smaller than a pixel of it: it is left out there and becomes a sun lamp
with the irradiance that a close-up of it has.
"""

from __future__ import annotations

import numpy as np

from ..solver.scene import Sky, SunLamp
from .colors import NO_LIGHT, NotSimple, sound
from .panorama import close_up, panorama, world_scene
from .remarks import no_numbers, nodes_of, world_remarks
from .sockets import Reader, source, uses_nodes

SMOOTH_WIDTH, SMOOTH_SAMPLES = 512, 4  # width [pixels], and samples of one, of skies made by formulas
# Width [pixels], and samples of one, of the widest skies that show images; narrower ones get more
# samples.
IMAGE_WIDTH, IMAGE_SAMPLES = 2048, 4
# Share [of the sky's light] of a pixel, from which on it and those up to so far [pixels] around are rendered again; samples of one of
# these, and of all of them together, at most; number [boxes] of such pixels, at most.
BRIGHT, AROUND, BRIGHT_SAMPLES, ALL_SAMPLES, MOST_BOXES = 1e-3, 2, 1024, 1 << 22, 16
CLOSE_UP, DISK_SAMPLES = 64, 4  # edge [pixels] across twice the sun's disk, and samples of a pixel


def read_world(scene, reader: Reader, warnings: list[str]) -> tuple[Sky | None, list[SunLamp]]:
    """The sky, None for a black one, and the suns in it. Call inside ``traceless()``."""
    world = scene.world
    if world is None or not _lights_diffuse(world):
        return None, []
    warnings += world_remarks(world)
    try:
        color = constant_radiance(world, reader)
    except NotSimple:
        return _rendered(scene, warnings)
    color = _sound(color, world, warnings)
    if not np.any(color > 0.0):
        return None, []
    return Sky(color.astype(np.float32).reshape(1, 1, 3)), []


def _lights_diffuse(world) -> bool:
    visibility = getattr(world, "cycles_visibility", None)
    return True if visibility is None else bool(visibility.diffuse)


def constant_radiance(world, reader: Reader) -> np.ndarray:
    """(3,) radiance. Raises NotSimple when it varies with direction or Cycles must evaluate it."""
    if not uses_nodes(world):
        return np.array(world.color, np.float64)
    output = world.node_tree.get_output_node("CYCLES")
    origin = source(output.inputs["Surface"]) if output is not None else None
    if origin is None:
        return np.zeros(3)
    node = origin[0]
    if node.bl_idname != "ShaderNodeBackground" or node.mute:
        raise NotSimple(f"world node {node.name}")
    strength = reader.color(node.inputs["Strength"])
    if strength.is_constant and strength.is_black:
        return np.zeros(3)
    color = reader.color(node.inputs["Color"])
    if not (color.is_constant and strength.is_constant):
        raise NotSimple("the world varies with direction")
    return color.factor * strength.factor


def _sound(radiance: np.ndarray, world, warnings: list[str]) -> np.ndarray:
    radiance, bad = sound(radiance)
    if bad and not (uses_nodes(world) and no_numbers(world.node_tree)):  # which is told already
        warnings.append(
            f'world "{world.name}" is {NO_LIGHT}, all around or in places; that is taken as 0'
        )
    return radiance


def _rendered(scene, warnings: list[str]) -> tuple[Sky | None, list[SunLamp]]:
    """The panorama without sun disks, and a sun lamp for each disk."""
    temporary, world = world_scene(scene.world, scene)
    suns = [node for node in nodes_of(world.node_tree) if _has_disk(node)]
    for node in suns:
        node.sun_disc = False
        for link in list(node.inputs["Vector"].links):  # which a sky with a disk ignores
            node.id_data.links.remove(link)
    pixels = _with_bright_pixels(temporary, panorama(temporary, *_resolution(world.node_tree)))
    pixels = _sound(pixels, scene.world, warnings)
    if pixels.max() == pixels.min() or np.ptp(pixels, axis=(0, 1)).max() < 1e-5 * pixels.max():
        pixels = pixels.mean(axis=(0, 1), keepdims=True)
    lamps = []
    for index, node in enumerate(suns):
        lamps += _sun_lamp(temporary, node, f"{scene.world.name} sun {index + 1}", pixels)
    return (Sky(pixels) if np.any(pixels > 0.0) else None), lamps


def _with_bright_pixels(temporary, pixels: np.ndarray) -> np.ndarray:
    """The panorama ``pixels`` (height, width, 3), those that bring much of its light rendered with many samples: a photograph's sun is
    a pixel or two, and between the middles of its own pixels as steep as a tent."""
    light = pixels.mean(axis=2) * np.cos(np.pi * ((np.arange(len(pixels)) + 0.5) / len(pixels) - 0.5))[:, None]
    bright = light > BRIGHT * light.sum()
    if not bright.any():  # as where a pixel is no number
        return pixels
    from scipy import ndimage

    bright = ndimage.binary_dilation(bright, np.ones((3, 3)), AROUND)
    regions = ndimage.label(bright)[0]
    boxes = ndimage.find_objects(regions)
    order = np.argsort(-ndimage.sum_labels(light, regions, np.arange(1, len(boxes) + 1)))[:MOST_BOXES]
    pixels = pixels.copy()
    for rows, columns in (boxes[k] for k in order):
        part = pixels[rows, columns]
        samples = int(np.clip(ALL_SAMPLES // part[..., 0].size, 1, BRIGHT_SAMPLES))
        part[:] = panorama(temporary, pixels.shape[1], samples, (rows, columns))
    return pixels


def _has_disk(node) -> bool:
    """Whether this is a sky texture of the user's copied tree that shows a disk."""
    if node.bl_idname != "ShaderNodeTexSky" or node.mute or node.id_data.library is not None:
        return False
    return node.sky_type not in ("PREETHAM", "HOSEK_WILKIE") and node.sun_disc


def _resolution(tree) -> tuple[int, int]:
    """Width of the panorama, and samples for each pixel."""
    widths = [
        node.image.size[0]
        for node in nodes_of(tree)
        if getattr(node, "image", None) is not None and node.image.size[0] > 0
    ]
    if not widths:
        return SMOOTH_WIDTH, SMOOTH_SAMPLES
    width = int(np.clip(max(widths), SMOOTH_WIDTH, IMAGE_WIDTH)) // 2 * 2
    return width, IMAGE_SAMPLES * (IMAGE_WIDTH // width)


def _sun_lamp(temporary, node, name: str, sky: np.ndarray) -> list[SunLamp]:
    """The disk as a lamp: its irradiance is what a close-up of it has beyond the ``sky``."""
    toward, size = _disk_direction(node), float(node.sun_size)
    node.sun_disc = True
    picture = close_up(temporary, toward, 2.0 * size, CLOSE_UP, DISK_SAMPLES)
    node.sun_disc = False
    rays, weight = _close_up_rays(toward, 2.0 * size)
    row, column = _pixel_of(toward, sky.shape)
    disk = picture - sky[row, column]
    disk = np.where(disk > 0.01 * disk.max(axis=(0, 1)), disk, 0.0)  # the sky is not the disk
    irradiance = np.einsum("ijc,ij->c", disk, weight)
    if not np.any(irradiance > 0.0):
        return []
    middle = np.einsum("ijk,ij->k", rays, disk.sum(axis=2) * weight)
    return [SunLamp(name, -middle / np.linalg.norm(middle), irradiance, size)]


def _disk_direction(node) -> np.ndarray:
    """(3,) unit direction toward the disk: rotation turns from +y toward +x."""
    elevation, rotation = node.sun_elevation, node.sun_rotation
    across = np.cos(elevation)
    return np.array([across * np.sin(rotation), across * np.cos(rotation), np.sin(elevation)])


def _pixel_of(toward: np.ndarray, shape) -> tuple[int, int]:
    """Row and column of a direction in a panorama laid out as ``solver.scene.Sky``."""
    u = 0.5 - np.arctan2(toward[1], toward[0]) / (2.0 * np.pi)
    v = 0.5 + np.arcsin(np.clip(toward[2], -1.0, 1.0)) / np.pi
    return min(int(v * shape[0]), shape[0] - 1), min(int(u * shape[1]), shape[1] - 1)


def _close_up_rays(toward: np.ndarray, angle: float) -> tuple[np.ndarray, np.ndarray]:
    """Unit directions (n, n, 3) of a close-up's pixels, and their solid angle (n, n) [sr] times
    the cosine to ``toward``: pixel area · cos³ · cos."""
    from mathutils import Vector

    rotation = np.array(Vector(toward).to_track_quat("-Z", "Y").to_matrix(), np.float64)
    half = np.tan(angle / 2.0)
    middles = ((np.arange(CLOSE_UP) + 0.5) / CLOSE_UP * 2.0 - 1.0) * half
    x, y = np.meshgrid(middles, middles)
    rays = np.stack([x, y, -np.ones_like(x)], axis=-1)
    length = np.linalg.norm(rays, axis=-1)
    weight = (2.0 * half / CLOSE_UP) ** 2 / length**4
    return (rays / length[..., None]) @ rotation.T, weight
