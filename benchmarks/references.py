"""Two independent Cycles references of a scene, made once and kept.

They are kept in the folder named by RADIOSITY_REFERENCES (else one in the system's temporary
folder), under a fingerprint of all that decides their values.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .cycles import cycles_bake

SEEDS = (101, 202)


@dataclass(frozen=True)
class References:
    """Two bakes (size, size, 3) of equal quality; ``mask``: texels that belong to a face."""

    a: np.ndarray
    b: np.ndarray
    mask: np.ndarray
    seconds: float  # that one of them took


def folder() -> Path:
    """Where references are kept; made if missing."""
    default = Path(tempfile.gettempdir()) / "radiosity_references"
    path = Path(os.environ.get("RADIOSITY_REFERENCES", default))
    path.mkdir(parents=True, exist_ok=True)
    return path


def cycles_references(obj, size: int, samples: int, passes, uv_map="Radiosity") -> References:
    """The two references of ``obj`` as the open file lights it: kept ones, else baked now."""
    pair = [_kept_bake(obj, size, samples, seed, tuple(passes), uv_map) for seed in SEEDS]
    (a, mask, first), (b, _, second) = pair
    return References(a, b, mask, (first + second) / 2)


def _kept_bake(obj, size, samples, seed, passes, uv_map):
    key = fingerprint(obj, size, samples, seed, passes, uv_map)
    name = f"{obj.name}-{size}-{samples}-{seed}-{key}"
    return kept(name, lambda: cycles_bake(obj, size, samples, seed, passes, uv_map))


def kept(name: str, bake):
    """What ``bake()`` gives, or gave before under this ``name``: pixels (size, size, 3) float64,
    mask (size, size) bool, and seconds."""
    path = folder() / f"{name}.npz"
    if not path.exists():
        pixels, mask, seconds = bake()
        partial = path.with_suffix(f".{os.getpid()}.npz")
        np.savez_compressed(partial, pixels=pixels.astype(np.float32), mask=mask, seconds=seconds)
        os.replace(partial, path)
    with np.load(path) as found:
        return found["pixels"].astype(float), found["mask"], float(found["seconds"])


def fingerprint(obj, *options) -> str:
    """Sixteen hexadecimal digits that change with geometry, UVs, materials, lamps or world."""
    import bpy

    digest = hashlib.sha256(repr((bpy.app.version, obj.name, *options)).encode())
    scene, graph = bpy.context.scene, bpy.context.evaluated_depsgraph_get()
    for instance in graph.object_instances:
        source = instance.object
        digest.update(repr((source.type, source.name, source.hide_render)).encode())
        digest.update(np.array(instance.matrix_world, np.float32).tobytes())
        if source.type == "MESH":
            _add_mesh(digest, source.data)
        elif source.type == "LIGHT":
            digest.update(_values(source.data).encode())
    for material in sorted(bpy.data.materials, key=lambda item: item.name):
        _add_nodes(digest, material)
    if scene.world:
        _add_nodes(digest, scene.world)
        digest.update(_values(scene.world).encode())
    return digest.hexdigest()[:16]


def _add_mesh(digest, mesh) -> None:
    fields = [(mesh.vertices, "co", 3, np.float32), (mesh.loops, "vertex_index", 1, np.int32),
              (mesh.polygons, "material_index", 1, np.int32)]  # fmt: skip
    fields += [(layer.data, "uv", 2, np.float32) for layer in mesh.uv_layers]
    for items, name, width, kind in fields:
        values = np.empty(width * len(items), kind)
        items.foreach_get(name, values)
        digest.update(values.tobytes())


def _add_nodes(digest, owner) -> None:
    """Every node with its unlinked inputs and settings, and the links between nodes."""
    digest.update(_values(owner).encode())
    if not owner.node_tree:
        return
    for node in sorted(owner.node_tree.nodes, key=lambda item: item.name):
        digest.update((node.name + _values(node)).encode())
        for socket in node.inputs:
            value = getattr(socket, "default_value", None)
            digest.update(repr(tuple(value) if hasattr(value, "__len__") else value).encode())
    links = [(link.from_node.name, link.from_socket.name, link.to_node.name, link.to_socket.name)
             for link in owner.node_tree.links]  # fmt: skip
    digest.update(repr(sorted(links)).encode())


def _values(block) -> str:
    """Numbers, names and short vectors of a data-block, but none that point or only display."""
    shown = {"location", "location_absolute", "select", "width", "height", "dimensions", "tag",
             "session_uid", "use_nodes", "is_evaluated", "users", "hide"}  # fmt: skip
    found = []
    for field in block.bl_rna.properties:
        name = field.identifier
        if field.type in {"POINTER", "COLLECTION"} or name in shown or name.startswith("bl_"):
            continue
        value = getattr(block, name)
        found.append((name, tuple(value) if getattr(field, "is_array", False) else value))
    return repr(found)
