"""The study's scenes, each built into an empty file as one mesh to bake.

All materials are matte, so that Cycles' Diffuse bake and ours mean the same light. Scenes from
files lie in the folder named by RADIOSITY_SCENES, else ../shared/scenes beside the project.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Callable

import numpy as np

from .quads import block, column, mesh_object, room, wall_with_window
from .scene_parts import emitter, glowing, matte, point, sky, sun

FOLDER = Path(__file__).resolve().parent.parent.parent / "shared" / "scenes"
FURNACE_REFLECTANCE = 0.7


class SceneMissing(Exception):
    """The file of a scene is not here; the message says where it was looked for."""


@dataclass(frozen=True)
class StudyScene:
    """``build()`` fills the empty file and returns the object to bake. ``size``: texels along the
    image's edge; ``reference``: Cycles samples of a reference; ``exact``: radiance, if known;
    ``doubled``: faces lie on one another, and are not compared (see error.doubled_texels)."""

    name: str
    build: Callable
    size: int = 256
    reference: int = 2048
    exact: float | None = None
    doubled: bool = False


def cornell():
    """The demo: a Cornell box."""
    from radiosity_addon.export.demo import build_demo

    return build_demo("cornell")


def window_room():
    """A furnished room of 4 × 5 × 2.6 m lit by the sky through its only window."""
    wall, wood = matte("Wall", (0.75, 0.72, 0.68)), matte("Wood", (0.35, 0.2, 0.1))
    carpet, frame = matte("Carpet", (0.3, 0.32, 0.45)), matte("Frame", (0.7, 0.7, 0.7))
    shell = room((-2, -2.5, 0), (2, 2.5, 2.6), skip=("+y",))
    faces = [(quad, 2 if side == "-z" else 0) for side, quad in shell]
    faces += [(quad, 3) for quad in wall_with_window((-2, 2), (0, 2.6), 2.5, 0.3,
                                                     (-0.8, 0.8), (0.9, 2.1))]  # fmt: skip
    faces += [(quad, 1) for quad in block((-0.6, -0.2, 0.7), (0.9, 0.7, 0.75))]  # a table
    for x, y in ((-0.5, -0.1), (0.8, -0.1), (-0.5, 0.6), (0.8, 0.6)):
        faces += [(quad, 1) for quad in block((x - 0.03, y - 0.03, 0), (x + 0.03, y + 0.03, 0.699))]
    faces += [(quad, 1) for quad in block((-1.99, -2.0, 0), (-1.5, -0.6, 1.9))]  # a cupboard
    sky((0.55, 0.75, 1.0), 4.0)
    return mesh_object("Window room", faces, (wall, wood, carpet, frame))


def lamp_hall(across: int = 8):
    """A hall of 24 × 24 × 5 m with columns under ``across``² small lamps of changing color."""
    plaster, stone = matte("Plaster", (0.7, 0.7, 0.66)), matte("Stone", (0.4, 0.36, 0.33))
    red = matte("Red", (0.6, 0.12, 0.08))
    faces = [(quad, 2 if side == "-x" else 1 if side == "-z" else 0)
             for side, quad in room((0, 0, 0), (24, 24, 5))]  # fmt: skip
    for x in (6, 12, 18):
        for y in (6, 12, 18):
            faces += [(quad, 1) for quad in column((x, y), 0.5, 5.0, 10)]
    random = np.random.default_rng(3)
    for k in range(across**2):
        place = (np.array([k % across, k // across]) + 0.5) * 24 / across
        place += random.uniform(-0.4, 0.4, 2)
        color = np.array([1.0, 0.75, 0.5]) * (1 - 0.5 * random.random()) + 0.2 * random.random(3)
        height = random.uniform(3.0, 4.6)
        point(f"Lamp {k}", (*place, height), 40.0 * random.uniform(0.3, 2), 0.05, tuple(color))
    return mesh_object("Lamp hall", faces, (plaster, stone, red))


def street(blocks: int = 6):
    """Two rows of houses along a street under a low sun and a blue sky; open to the outside."""
    asphalt, plaster = matte("Asphalt", (0.08, 0.08, 0.09)), matte("Plaster", (0.65, 0.58, 0.45))
    brick = matte("Brick", (0.45, 0.18, 0.12))
    end = 10.0 * blocks + 5
    ground = np.array([(-25.0, -5, 0), (25, -5, 0), (25, end, 0), (-25, end, 0)])
    faces, random = [(ground, 0)], np.random.default_rng(5)
    for k in range(2 * blocks):
        low = 10.0 * (k // 2) + random.uniform(0.3, 1.0)
        near, height = random.uniform(4, 6), random.uniform(5, 14)
        x = (near, near + 9) if k % 2 else (-near - 9, -near)
        house = block((x[0], low, 0), (x[1], low + random.uniform(6, 9), height))
        faces += [(quad, 1 + k % 3 // 2) for quad in house]
    sun(4.0, (0.9, 0.3, 0.6), 0.02)
    sky((0.45, 0.65, 1.0), 0.6)
    return mesh_object("Street", faces, (asphalt, plaster, brick))


def suzanne_furnace(levels: int = 2):
    """Suzanne, subdivided, in a closed box; everything reflects 0.7 and emits 0.3 W/m²: B = 1."""
    import bpy

    bpy.ops.mesh.primitive_monkey_add(size=1.0, location=(0, 0, 0))
    head = bpy.context.object
    modifier = head.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = levels
    wall = glowing("Furnace", FURNACE_REFLECTANCE, 1 - FURNACE_REFLECTANCE)
    head.data.materials.append(wall)
    walls = [(quad, 0) for _, quad in room((-1, -1, -1), (1, 1, 1))]
    return join([mesh_object("Walls", walls, (wall,)), head], "Furnace")


def lit_by_a_lamp_panel():
    """The tiniest scene: a cube room with a glowing panel, far enough from the ceiling for versions
    of Cycles to agree on what lies in the gap; for tests."""
    faces = [(quad, 0) for _, quad in room((0, 0, 0), (1, 1, 1))]
    panel = np.array([(0.3, 0.3, 0.8), (0.3, 0.7, 0.8), (0.7, 0.7, 0.8), (0.7, 0.3, 0.8)])
    materials = matte("Wall", (0.6, 0.5, 0.4)), emitter("Panel", (1, 1, 1), 5.0)
    return mesh_object("Cube room", [*faces, (panel, 1)], materials)


def living_room():
    """A house with furniture by other people: sun through its windows, and sky."""
    objects = _from_file("living_room.blend")
    sun(5.0, (0.9, 0.1, 0.5), 0.01)
    sky((0.6, 0.75, 1.0), 1.0)
    return join(objects, "Living room")


def glass_room():
    """A room of other people's with 16 spheres, here matte; sun and sky through its windows."""
    objects = _from_file("room.blend")
    sun(5.0, (0.8, 0.2, 0.4), 0.01)
    sky((0.6, 0.75, 1.0), 1.0)
    return join(objects, "Room")


SCENES = {
    scene.name: scene
    for scene in (
        StudyScene("cornell", cornell),
        StudyScene("window_room", window_room, reference=4096),
        StudyScene("lamp_hall", lamp_hall, reference=1024),
        StudyScene("street", street, reference=512),
        StudyScene("furnace", suzanne_furnace, exact=1 / np.pi),
        StudyScene("living_room", living_room, reference=1024, doubled=True),
        StudyScene("room", glass_room, reference=1024),
    )
}


def build(scene: StudyScene):
    """The scene alone in an empty file, its object with the UV map "Radiosity".

    Raises SceneMissing for a scene whose file is not here.
    """
    import bpy

    from radiosity_addon.bake.unwrap import ensure_uv_map

    bpy.ops.wm.read_factory_settings(use_empty=True)
    obj = scene.build()
    bpy.context.view_layer.update()
    ensure_uv_map([obj], "Radiosity", scene.size)
    return obj


def scene_file(name: str) -> Path:
    """Where the file ``name`` of other people's lies. Raises SceneMissing."""
    path = Path(os.environ.get("RADIOSITY_SCENES", FOLDER)) / name
    if not path.exists():
        raise SceneMissing(f"{path} does not exist; name its folder in RADIOSITY_SCENES")
    return path


def _from_file(name: str) -> list:
    """The meshes of a file, appended, modifiers applied, every material a matte one."""
    import bpy

    path = scene_file(name)
    with bpy.data.libraries.load(str(path)) as (there, here):
        here.objects = there.objects
    objects = [obj for obj in here.objects if obj and obj.type == "MESH"]
    for obj in objects:
        bpy.context.scene.collection.objects.link(obj)
    mattes = {}
    for obj in objects:
        for slot in obj.material_slots:
            slot.material = mattes.setdefault(slot.material.name, _matte_of(slot.material))
    return objects


def _matte_of(material):
    nodes = material.node_tree.nodes
    principled = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
    color = tuple(principled.inputs["Base Color"].default_value)[:3]
    return matte(f"Matte {material.name}", color)


def join(objects: list, name: str):
    """One object of several, modifiers applied as evaluated, world transforms applied."""
    import bpy

    graph = bpy.context.evaluated_depsgraph_get()
    for obj in objects:
        evaluated = obj.evaluated_get(graph)
        mesh = bpy.data.meshes.new_from_object(evaluated)
        obj.modifiers.clear()
        obj.data = mesh
        while mesh.uv_layers:  # the study makes its own
            mesh.uv_layers.remove(mesh.uv_layers[0])
    first = objects[0]
    if len(objects) > 1:
        with bpy.context.temp_override(active_object=first, selected_editable_objects=objects):
            bpy.ops.object.join()
    first.data.transform(first.matrix_world)
    first.matrix_world.identity()
    first.name = name
    return first
