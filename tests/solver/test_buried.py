"""What is buried in solids does not count, and light is not shared across what stands on a face."""

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.bake.faces import receiver_areas
from radiosity_addon.bake.texels import texel_receivers
from radiosity_addon.solver.filtering.graph import build_graph
from radiosity_addon.solver.filtering.lattice_weights import build_lattices
from radiosity_addon.solver.filtering.walls import find_walls
from radiosity_addon.solver.geometry.footprints import build_footprints
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.scene import PointLamp, Scene
from radiosity_addon.solver.tracing.buried import find_surroundings, without_buried
from radiosity_addon.solver.transport.receiver_patches import ONWARD, build_receiver_patches
from verification import meshes

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
FLOOR = SQUARE, np.array([[0, 1, 2], [0, 2, 3]])
UV = SQUARE[FLOOR[1]][..., :2]
OUTWARD = meshes.BOX[:, ::-1]
BLOCK = (0.3, 0.2, 0.5)


def block(size=BLOCK, origin=(0.4, 0.3, 0.0), turn=0.0, faces=OUTWARD):
    """A box, turned about the vertical axis through the origin."""
    cos, sin = np.cos(turn), np.sin(turn)
    vertices = meshes.CORNERS * np.asarray(size) + np.asarray(origin)
    vertices = vertices @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])
    return vertices, np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])


def opened(scene: Scene, receivers):
    """The open parts of receivers, which are wholly buried, and the context."""
    context = build_context(scene, 0, 1, silent)
    around = find_surroundings(scene, context.geometry, ~context.transmits, 1)
    if around is None:
        return receivers, np.zeros(receivers.count, bool), context
    return *without_buried(around, context.crossings, receivers), context


def open_area(scene: Scene, receivers) -> float:
    kept, buried, _ = opened(scene, receivers)
    return receiver_areas(scene.vertices, scene.triangles, kept)[~buried].sum()


@pytest.mark.parametrize("bottom", [0.0, -0.1], ids=["standing", "sunk"])
@pytest.mark.parametrize("turn", [0.0, 0.3])
def test_what_is_left_of_a_floor_is_what_a_block_does_not_cover(turn, bottom):
    """1 − 0.3 · 0.2; texels of which less than a quarter is open count as buried: of those on the
    block's outline, 1 / 64 wide and 1 long, a quarter, which show an eighth in the mean."""
    scene = meshes.scene([FLOOR, block(origin=(0.4, 0.3, bottom), turn=turn)])
    texels = texel_receivers(UV, np.arange(2), 64)
    assert open_area(scene, texels) == pytest.approx(1 - 0.06, abs=1.6e-3)
    assert open_area(scene, meshes.triangle_receivers(scene, 4)) > 0


def test_the_underside_of_a_block_on_a_sheet_is_buried_and_its_other_faces_are_not():
    scene = meshes.scene([FLOOR, block()])
    receivers = meshes.triangle_receivers(scene)
    _, buried, _ = opened(scene, receivers)
    normal = np.cross(*(np.diff(scene.vertices[scene.triangles], axis=1).transpose(1, 0, 2)))
    assert np.flatnonzero(buried).tolist() == np.flatnonzero(normal[:, 2] < 0).tolist()


def test_faces_of_blocks_that_touch_are_buried_where_they_touch():
    """Side by side, the second half as high: half of the first one's side is open."""
    low = block((0.3, 0.2, 0.25), (0.7, 0.3, 0.0))
    scene = meshes.scene([block(), low])
    whole = meshes.areas(scene.vertices, scene.triangles).sum()
    left = open_area(scene, meshes.triangle_receivers(scene, 8))
    assert left == pytest.approx(whole - 2 * 0.25 * 0.2, rel=1e-5)


def room(kind: str) -> Scene:
    """Something on the floor in which nothing is buried."""
    parts = [FLOOR, block()]
    if kind == "sheets":
        parts[1] = block(faces=OUTWARD[:4])
    if kind == "thick walls":  # a room from 0.45 to 0.65, 0.35 to 0.45, in a shell
        parts[1] = block(origin=(0.4, 0.3, -0.1))
        parts.append(block((0.2, 0.1, 0.3), (0.45, 0.35, -0.05), faces=meshes.BOX))
    scene = meshes.scene(parts, exitance=np.array([[0], [0.0], [0.0]][: len(parts)]))
    if kind == "a lamp inside":
        lamp = PointLamp("Bulb", np.array([0.5, 0.4, 0.2]), np.ones(3))
        scene = replace(scene, lamps=(lamp,))
    return scene


@pytest.mark.parametrize(
    "kind, left", [("sheets", 1.0), ("a lamp inside", 1.0), ("thick walls", 1 - 0.06 + 0.02)]
)
def test_rooms_are_not_buried(kind, left):
    assert open_area(room(kind), texel_receivers(UV, np.arange(2), 64)) == pytest.approx(left, abs=2e-3)


def spread_from(scene: Scene, receivers, lit: np.ndarray) -> np.ndarray:
    """(count,) light after all kernels, of 1 where ``lit``; no light is lost on the way."""
    context = build_context(scene, 0, 1, silent)
    footprints = build_footprints(context.geometry, receivers)
    position, normal = footprints.middle()
    walls = find_walls(context, footprints, receivers)
    if receivers.grid is None:
        (neighbors,) = build_graph(position, normal, footprints.area, 1, walls)
    else:
        (neighbors,) = build_lattices(receivers.grid, position, normal, walls=walls)
    pictures = neighbors.as_pictures(np.stack([lit, np.ones(len(lit))], 1).astype(np.float32))
    for level in range(neighbors.levels):
        pictures = neighbors.step(*pictures, level=level)
    light, even = (neighbors.read(picture) for picture in pictures)
    assert even == pytest.approx(1, rel=1e-5)
    return light


@pytest.mark.parametrize("turn", [0.0, 0.3])
@pytest.mark.parametrize("target", ["texels", "faces"])
def test_light_is_not_smoothed_under_a_sheet_wall(target, turn):
    """A wall without thickness across the floor, 0.5 high, at x = 0.37 + turn · y: what lies
    wholly on the one side gets nothing of the light of the other side and of what the wall stands
    on, though lit everywhere there. Without the wall it does."""
    wall = np.array([[0.37, -1, -0.1], [0.37, 2, -0.1], [0.37, 2, 0.5], [0.37, -1, 0.5]])
    wall[:, 0] += turn * wall[:, 1]
    for parts in ([FLOOR], [FLOOR, (wall, FLOOR[1])]):
        scene = meshes.scene(parts)
        if target == "texels":
            receivers = texel_receivers(UV, np.arange(2), 48)
        else:
            receivers = meshes.triangle_receivers(meshes.scene([FLOOR]), 32)
        corners = scene.vertices[scene.triangles[receivers.triangle]]
        first, e1, e2 = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        local = receivers.corners
        fourth = local[:, 1] + local[:, 2] - local[:, 0]
        local = np.concatenate(
            [local, np.where(receivers.square[:, None], fourth, local[:, 0])[:, None]], axis=1
        )
        x = first[:, None] + local[..., :1] * e1[:, None] + local[..., 1:] * e2[:, None]
        beyond = x[..., 0] - turn * x[..., 1] - 0.37
        dark = np.ones(receivers.count, bool)
        dark[receivers.receiver[(beyond > -1e-6).any(axis=1)]] = False
        assert 100 < dark.sum() < receivers.count - 100
        light = spread_from(scene, receivers, ~dark)
        assert (light[dark].max() == 0) == (len(parts) == 2)


def test_rays_go_on_from_receivers_that_a_sheet_divides():
    """A sheet at x = 0.37 through the sixth of sixteen columns: it alone has no patches."""
    wall = np.array([[0.37, -1, -0.1], [0.37, 2, -0.1], [0.37, 2, 0.5], [0.37, -1, 0.5]])
    scene = meshes.scene([FLOOR, (wall, FLOOR[1])])
    context = build_context(scene, 0, 1, silent)
    receivers = texel_receivers(UV, np.arange(2), 16)
    footprints = build_footprints(context.geometry, receivers)
    divided = find_walls(context, footprints, receivers).divided
    found = build_receiver_patches(
        receivers, footprints, scene.object, context.geometry.area, np.inf, divided
    )
    x, y = np.random.default_rng(0).random((2, 1000))
    lower = x > y  # the first triangle: (0, 0), (1, 0), (1, 1); the second: (0, 0), (1, 1), (0, 1)
    u, v = np.where(lower, x - y, x), np.where(lower, y, y - x)
    owner = found.at(np.where(lower, 0, 1), u, v, np.ones(1000, bool))
    assert np.array_equal(owner == ONWARD, np.floor(x * 16) == 5)
    assert (owner[owner != ONWARD] >= 0).all()
