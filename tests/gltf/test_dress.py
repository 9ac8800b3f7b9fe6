"""The document that is written, without Blender: bytes in, bytes out."""

from __future__ import annotations

import math

import numpy as np
import pytest

from radiosity_addon.gltf.dress import CARRIED, TAG, Dress, Lightmap, dress
from radiosity_addon.gltf.glb import Glb, read_glb, write_glb

CORNERS = np.array([[0, 0], [1, 0], [0.25, 0.75]], np.float32)
KEY = f"{CARRIED}0"  # what the bake of both objects travels by
COLORED = frozenset({"A"})
ON = {"A": KEY, "B": KEY}
LIGHT = np.array([[4, 2, 1, 1], [0, 0.5, 1, 1], [7, 7, 7, 1]], np.float32)


def glb_of(attributes: dict[str, np.ndarray], nodes=("A",), material=None) -> Glb:
    """A triangle whose nodes are tagged with their own names."""
    glb = Glb({"asset": {"version": "2.0"}}, b"")
    glb.document["accessors"] = []
    numbers = {name: glb.add_floats(values) for name, values in attributes.items()}
    primitive = {"attributes": numbers}
    if material is not None:
        glb.document["materials"] = [material]
        primitive["material"] = 0
    glb.document["meshes"] = [{"name": "M", "primitives": [primitive]}]
    glb.document["nodes"] = [{"name": n, "mesh": 0, "extras": {TAG: n}} for n in nodes]
    return glb


def primitive_of(glb: Glb, node: int = 0) -> dict:
    return glb.document["meshes"][glb.document["nodes"][node]["mesh"]]["primitives"][0]


def test_colors_are_alone_float_and_uncut_after_a_round_trip(tmp_path):
    """White COLOR_0 that Blender's exporter made goes, 7 stays 7."""
    glb = glb_of({"COLOR_0": np.ones((3, 4), np.float32), "COLOR_1": LIGHT / 7, KEY: LIGHT})
    assert dress(glb, Dress(COLORED, None, ON)) == ["A"]
    write_glb(glb, tmp_path / "a.glb")
    back = read_glb(tmp_path / "a.glb")
    attributes = primitive_of(back)["attributes"]
    assert set(attributes) == {"COLOR_0"}
    np.testing.assert_array_equal(back.floats(attributes["COLOR_0"]), LIGHT)
    assert back.document["extensionsUsed"] == ["KHR_materials_unlit"]
    assert "extras" not in back.document["nodes"][0]


def test_a_bake_without_color_keeps_the_base_color_and_its_texture():
    surface = {"baseColorFactor": [0.5, 0.5, 0.5, 1], "baseColorTexture": {"index": 0}}
    for colored, expected in ((False, {**surface, "metallicFactor": 0.0}), (True, None)):
        glb = glb_of({KEY: LIGHT}, material={"name": "Paint", "pbrMetallicRoughness": surface})
        dress(glb, Dress(COLORED if colored else frozenset(), None, ON))
        made = glb.document["materials"][primitive_of(glb)["material"]]
        if colored:
            assert made["pbrMetallicRoughness"]["baseColorFactor"] == [1, 1, 1, 1]
            assert "baseColorTexture" not in made["pbrMetallicRoughness"]
        else:
            assert made["pbrMetallicRoughness"] == expected
        assert glb.document["materials"][0]["pbrMetallicRoughness"] == surface  # others may use it


def test_intensity_is_pi_times_the_scale_on_the_second_uv_turned_over():
    """three.js shows texel · intensity · ρ / π, so that π cancels; v counts from the top."""
    glb = glb_of({KEY: CORNERS, "TEXCOORD_0": CORNERS / 2})
    dress(glb, Dress(frozenset(), {"A": Lightmap("L", b"png", 2.5)}, ON))
    primitive = primitive_of(glb)
    extension = glb.document["materials"][primitive["material"]]["extensions"]["MOZ_lightmap"]
    assert extension == {"index": 0, "texCoord": 1, "intensity": pytest.approx(2.5 * math.pi)}
    np.testing.assert_array_equal(
        glb.floats(primitive["attributes"]["TEXCOORD_1"]), [[0, 1], [1, 1], [0.25, 0.25]]
    )
    assert KEY not in primitive["attributes"]


def test_a_second_map_that_a_material_uses_is_not_overwritten():
    """Sets 0 and 1 are the user's: the lightmap's is 2, and says so."""
    glb = glb_of({KEY: CORNERS, "TEXCOORD_0": CORNERS / 2, "TEXCOORD_1": CORNERS / 3})
    dress(glb, Dress(frozenset(), {"A": Lightmap("L", b"png", 1.0)}, ON))
    primitive = primitive_of(glb)
    slot = glb.document["materials"][primitive["material"]]["extensions"]["MOZ_lightmap"]["texCoord"]
    assert slot == 2
    np.testing.assert_array_equal(
        glb.floats(primitive["attributes"]["TEXCOORD_1"]), CORNERS / np.float32(3)
    )


def test_objects_that_share_a_mesh_get_a_lightmap_each():
    """Two nodes, one mesh, two images: two meshes on the same accessors; a third node that was
    not baked keeps the first mesh without a lightmap."""
    glb = glb_of({KEY: CORNERS}, nodes=("A", "B"))
    glb.document["nodes"].append({"name": "C", "mesh": 0})
    images = {name: Lightmap(name, name.encode(), 1.0) for name in "AB"}
    assert dress(glb, Dress(frozenset(), images, ON)) == ["A", "B"]
    meshes = [node["mesh"] for node in glb.document["nodes"]]
    assert len(set(meshes)) == 3
    assert "material" not in primitive_of(glb, 2)
    index = [glb.document["materials"][primitive_of(glb, n)["material"]] for n in (0, 1)]
    sources = [m["extensions"]["MOZ_lightmap"]["index"] for m in index]
    assert sources == [0, 1]


def test_each_object_gets_what_its_own_bake_travels_by():
    """What is a UV map's name on B is a color's on A: it is left out there."""
    other = f"{CARRIED}1"
    glb = glb_of({KEY: CORNERS, other: LIGHT})
    assert dress(glb, Dress(frozenset(), {"A": Lightmap("L", b"png", 1.0)}, {"A": KEY, "B": other})) == ["A"]
    assert set(primitive_of(glb)["attributes"]) == {"TEXCOORD_0", "TEXCOORD_1"}
    colored = glb_of({KEY: CORNERS, other: LIGHT})
    assert dress(colored, Dress(COLORED, None, {"A": other})) == ["A"]
    assert set(primitive_of(colored)["attributes"]) == {"COLOR_0"}


def test_a_node_without_the_bake_is_not_counted():
    glb = glb_of({"TEXCOORD_0": CORNERS})
    assert dress(glb, Dress(COLORED, None, ON)) == []
    assert "material" not in primitive_of(glb)


def test_a_file_that_is_no_glb_is_refused(tmp_path):
    path = tmp_path / "bad.glb"
    path.write_bytes(b"x" * 40)
    with pytest.raises(ValueError, match="no GLB"):
        read_glb(path)
