"""Put the bake where engines look for it in a glTF document. Imports no bpy.

Blender's exporter has carried the colors or the lightmap's UVs along as attributes of our own;
here they become COLOR_0, or a second set of texture coordinates and a ``MOZ_lightmap``.

What an engine shows of an unlit material is COLOR_0 times the base color. A lightmap holds
irradiance: three.js shows lightMap · intensity · ρ / π, in lit and unlit materials alike
(lights_fragment_maps.glsl, BRDF_Lambert; meshbasic.glsl, RECIPROCAL_PI). Baked values are B/π, so that the
intensity is π times the scale of the image: the π is divided out again.
"""

from __future__ import annotations

import copy
import json
import math
from dataclasses import dataclass

from .glb import Glb

CARRIED = "_RADIOSITY_"  # begin [of names] of the attributes that the exporter carries
TAG = "radiosity_bake"  # in a node's extras: the name of its object
UNLIT, LIGHTMAP = "KHR_materials_unlit", "MOZ_lightmap"
LINEAR, CLAMP = 9729, 33071  # codes [OpenGL] of a texture's filter and wrapping
WHITE = {"baseColorFactor": [1.0, 1.0, 1.0, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0}

GRAY = {**WHITE, "baseColorFactor": [0.8, 0.8, 0.8, 1.0]}  # faces without material, in Cycles too


@dataclass(frozen=True)
class Lightmap:
    """The image of an object, or of several: a PNG of linear values divided by ``scale``."""

    name: str
    png: bytes
    scale: float


@dataclass(frozen=True)
class Dress:
    """What is to be put on: ``lightmaps`` by object name, or vertex colors when None.

    ``colored``: the objects whose bake holds the surface's own color: their materials become white and unlit.
    ``carried``: by object name, the attribute that holds its colors or its lightmap's UVs.
    """

    colored: frozenset[str]
    lightmaps: dict[str, Lightmap] | None
    carried: dict[str, str]


def dress(glb: Glb, bake: Dress) -> list[str]:
    """Change the document; returns the names of the objects that carry their bake now."""
    document = glb.document
    pristine = copy.deepcopy(document.get("meshes", []))
    nodes = document.get("nodes", [])
    tagged = [node for node in nodes if TAG in node.get("extras", {})]
    taken = {n["mesh"] for n in nodes if "mesh" in n and n not in tagged and bake.lightmaps}
    made: dict[str, int] = {}
    textures: dict[str, int] = {}
    dressed = []
    for node in tagged:
        name = _untag(node)
        if "mesh" not in node:
            continue
        mesh = copy.deepcopy(pristine[node["mesh"]])
        if not all([_primitive(glb, p, bake, name, made, textures) for p in mesh["primitives"]]):
            continue
        node["mesh"] = _put_mesh(document, node["mesh"], mesh, taken)
        dressed.append(name)
    _forget_carried(document)
    return dressed


def _untag(node: dict) -> str:
    name = node["extras"].pop(TAG)
    if not node["extras"]:
        del node["extras"]
    return name


def _put_mesh(document: dict, index: int, mesh: dict, taken: set[int]) -> int:
    """The mesh's number: its own, or a new one where another object has a different dress."""
    if index not in taken:
        taken.add(index)
        document["meshes"][index] = mesh
        return index
    if document["meshes"][index] == mesh:
        return index
    document["meshes"].append(mesh)
    return len(document["meshes"]) - 1


def _primitive(glb: Glb, primitive, bake: Dress, name: str, made, textures) -> bool:
    """Dress one primitive; False when it does not carry the bake."""
    attributes = primitive["attributes"]
    for other in [key for key in attributes if key.startswith("COLOR_")]:
        del attributes[other]
    carried = bake.carried.get(name)
    if carried not in attributes:
        return False
    if bake.lightmaps is None:
        attributes["COLOR_0"] = attributes.pop(carried)
        material = _unlit(_material(glb, primitive), name in bake.colored)
        glb.use(UNLIT)
    else:
        if name not in bake.lightmaps:
            return False
        slot = _second_uv(glb, attributes, carried)
        material = _material(glb, primitive)
        if name in bake.colored:
            material = _unlit(material, True)
            glb.use(UNLIT)
        _add_lightmap(glb, material, bake.lightmaps[name], slot, textures)
    primitive["material"] = _numbered(glb, material, made)
    return True


def _material(glb: Glb, primitive) -> dict:
    """A copy of the primitive's material; glTF's default where it has none."""
    index = primitive.get("material")
    if index is None:
        return {"name": "Baked", "pbrMetallicRoughness": dict(GRAY), "doubleSided": True}
    return copy.deepcopy(glb.document["materials"][index])


def _unlit(material: dict, colored: bool) -> dict:
    """The material as one that shows its base color (white where ``colored``) times the bake."""
    kept = {key: material[key] for key in ("name", "doubleSided") if key in material}
    surface = material.get("pbrMetallicRoughness", {})
    if colored:
        kept["pbrMetallicRoughness"] = dict(WHITE)
    else:
        kept["pbrMetallicRoughness"] = {**surface, "metallicFactor": 0.0}
        kept |= {key: material[key] for key in ("alphaMode", "alphaCutoff") if key in material}
    kept["extensions"] = {UNLIT: {}}
    return kept


def _second_uv(glb: Glb, attributes: dict, carried: str) -> int:
    """Make the carried UVs TEXCOORD_1, or the next free set where 1 is another; returns which.

    The exporter turns its own UV maps over, as glTF counts v from the top, but no attribute.
    """
    values = glb.floats(attributes.pop(carried)).copy()
    values[:, 1] = 1 - values[:, 1]
    accessor = glb.add_floats(values)
    attributes.setdefault("TEXCOORD_0", accessor)
    slot = 1
    while f"TEXCOORD_{slot}" in attributes:
        if (glb.floats(attributes[f"TEXCOORD_{slot}"]) == values).all():
            break
        slot += 1
    attributes[f"TEXCOORD_{slot}"] = accessor
    return slot


def _add_lightmap(glb: Glb, material: dict, lightmap: Lightmap, slot: int, textures) -> None:
    """Give a material its lightmap; objects of one image share a texture."""
    if lightmap.name not in textures:
        view = glb.add_view(lightmap.png)
        image = glb.append("images", {
            "bufferView": view, "mimeType": "image/png", "name": lightmap.name,
        })  # fmt: skip
        sampler = glb.append("samplers", {
            "magFilter": LINEAR, "minFilter": LINEAR, "wrapS": CLAMP, "wrapT": CLAMP,
        })  # fmt: skip
        textures[lightmap.name] = glb.append("textures", {"sampler": sampler, "source": image})
    material.setdefault("extensions", {})[LIGHTMAP] = {
        "index": textures[lightmap.name],
        "texCoord": slot,
        "intensity": math.pi * lightmap.scale,
    }
    glb.use(LIGHTMAP)


def _numbered(glb: Glb, material: dict, made: dict[str, int]) -> int:
    """The number of the material, the same for equal ones."""
    key = json.dumps(material, sort_keys=True)
    if key not in made:
        made[key] = glb.append("materials", material)
    return made[key]


def _forget_carried(document: dict) -> None:
    """Carried attributes are left where an object was not baked, or has another of these names: no
    engine needs them."""
    for mesh in document.get("meshes", []):
        for primitive in mesh["primitives"]:
            for name in [key for key in primitive["attributes"] if key.startswith(CARRIED)]:
                del primitive["attributes"][name]
