"""Cycles' bake of an object in this process: rival and reference.

Settings are those that make Cycles converge to the truth: no clamping, no denoising, no adaptive
sampling, no light threshold, bounces without a practical end; float images, no margin.
"""

from __future__ import annotations

import time
from contextlib import ExitStack, contextmanager

import numpy as np

BOUNCES = 128  # Russian roulette ends paths long before
EMIT_SAMPLES = 16  # one sample would be taken at the texel's center, whatever the seed
PASSES = ("emit", "direct", "indirect", "color")
CYCLES = {
    "device": "CPU",
    "use_adaptive_sampling": False,
    "use_denoising": False,
    "sample_clamp_direct": 0.0,
    "sample_clamp_indirect": 0.0,
    "light_sampling_threshold": 0.0,
    "max_bounces": BOUNCES,
    "diffuse_bounces": BOUNCES,
    "glossy_bounces": BOUNCES,
    "transmission_bounces": BOUNCES,
    "transparent_max_bounces": BOUNCES,
    "min_light_bounces": 0,
    "caustics_reflective": True,
    "caustics_refractive": True,
    "blur_glossy": 0.0,
    "use_fast_gi": False,
    "time_limit": 0.0,
}
# Not cleared by Blender, which would make every texel opaque: alpha tells which texels have a face.
BAKE = {"use_clear": False, "margin": 0, "view_from": "ABOVE_SURFACE", "target": "IMAGE_TEXTURES"}


def cycles_bake(
    obj,
    image_size: int,
    samples: int,
    seed: int = 0,
    passes: tuple[str, ...] = PASSES,
    uv_map: str = "Radiosity",
    threads: int = 2,
) -> tuple[np.ndarray, np.ndarray, float]:
    """Bake ``obj`` with Cycles and leave the file as it was.

    Returns the radiance (size, size, 3) float64 with row 0 at v = 0, the mask (size, size) of
    texels that belong to a face, and the seconds of the Diffuse bake; emission, which
    has no noise but the texel's footprint, is baked apart and not counted. Raises ValueError
    where the UV map, or the material of a slot, is missing.
    """
    if uv_map not in obj.data.uv_layers:
        raise ValueError(f"object {obj.name!r} has no UV map {uv_map!r}; make it before the bake")
    if not obj.material_slots or not all(slot.material for slot in obj.material_slots):
        raise ValueError(f"object {obj.name!r} has faces without material; Cycles bakes none there")
    lighting = {name.upper() for name in passes if name != "emit"}
    with _prepared(obj, image_size, seed, threads) as image:
        pixels, mask, seconds = np.zeros((image_size, image_size, 3)), None, 0.0
        if lighting:
            pixels, mask, seconds = _bake(image, "DIFFUSE", samples, uv_map, lighting)
        if "emit" in passes:
            emitted, mask, _ = _bake(image, "EMIT", EMIT_SAMPLES, uv_map, set())
            pixels = pixels + emitted
    return pixels, mask, seconds


def _bake(image, kind: str, samples: int, uv_map: str, lighting: set[str]):
    """One bake into the image: pixels (h, w, 3) float64, mask (h, w) bool, seconds."""
    import bpy

    bpy.context.scene.cycles.samples = samples
    image.pixels.foreach_set(np.zeros(4 * image.size[0] * image.size[1], np.float32))
    start = time.perf_counter()
    bpy.ops.object.bake(type=kind, pass_filter=lighting, uv_layer=uv_map, margin=0, use_clear=False)
    seconds = time.perf_counter() - start
    width, height = image.size
    pixels = np.empty(4 * width * height, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(height, width, 4)
    return pixels[..., :3].astype(np.float64), pixels[..., 3] > 0.5, seconds


@contextmanager
def _prepared(obj, image_size: int, seed: int, threads: int):
    """The scene set for baking ``obj`` into a new float image, and put back afterward."""
    import bpy

    scene = bpy.context.scene
    image = bpy.data.images.new(
        "Cycles bake", image_size, image_size, alpha=True, float_buffer=True
    )
    image.colorspace_settings.name = "Non-Color"
    with ExitStack() as stack:
        stack.callback(bpy.data.images.remove, image)
        stack.enter_context(_changed(scene.render, {
            "engine": "CYCLES", "threads_mode": "FIXED", "threads": threads,
        }))  # fmt: skip
        stack.enter_context(_changed(scene.cycles, CYCLES | {"seed": seed, "samples": 1}))
        stack.enter_context(_changed(scene.render.bake, BAKE))
        stack.enter_context(_selected(obj))
        for material in {slot.material for slot in obj.material_slots}:
            stack.enter_context(_target_node(material, image))
        yield image


@contextmanager
def _changed(owner, values: dict):
    """Attributes set for a while; what this version of Blender lacks is left out."""
    before = {name: getattr(owner, name) for name in values if hasattr(owner, name)}
    try:
        for name in before:
            setattr(owner, name, values[name])
        yield
    finally:
        for name, value in before.items():
            setattr(owner, name, value)


@contextmanager
def _selected(obj):
    """``obj`` alone selected and active."""
    import bpy

    layer = bpy.context.view_layer
    active, selected = layer.objects.active, [o for o in layer.objects if o.select_get()]
    try:
        for other in selected:
            other.select_set(False)
        obj.select_set(True)
        layer.objects.active = obj
        yield
    finally:
        obj.select_set(False)
        for other in selected:
            other.select_set(True)
        layer.objects.active = active


@contextmanager
def _target_node(material, image):
    """An active image node: where Cycles puts what it bakes from this material."""
    if not material.node_tree:
        material.use_nodes = True
    nodes = material.node_tree.nodes
    active, node = nodes.active, nodes.new("ShaderNodeTexImage")
    try:
        node.image = image
        nodes.active = node
        yield
    finally:
        nodes.remove(node)
        nodes.active = active
