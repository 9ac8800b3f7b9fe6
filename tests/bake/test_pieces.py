"""Corners of pieces: which are one unknown, and colors that are fitted over several meshes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.bake.exported_object import CornerMap, ExportedObject
from radiosity_addon.bake.hanging import Hanging, spread
from radiosity_addon.bake.pieces import MOST, joined_unknowns
from radiosity_addon.bake_job import Job, run
from radiosity_addon.settings import Settings
from radiosity_addon.solver.scene import PointLamp
from verification import meshes

QUAD = np.array([(0, 1, 2), (0, 2, 3)])
SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)


def join(second, material=(0, 0, 0, 0), free=True):
    """How many of eight corners are left of a unit square and the square ``second`` (4, 3)."""
    vertices = np.concatenate([SQUARE, second])
    triangles = np.concatenate([QUAD, QUAD + 4])
    label = joined_unknowns(
        vertices, triangles, triangles, 8, np.array(material),
        lambda ways: np.full(len(ways.starts), free),
    )[0]  # fmt: skip
    return label.max() + 1


def turned(degrees):
    """A square that goes on from the first one's side x = 1, turned up."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([(1, 0, 0), (1 + c, 0, s), (1 + c, 1, s), (1, 1, 0)])


@pytest.mark.parametrize(
    ("second", "left"),
    [
        (turned(0), 6),
        (turned(25), 6),
        (turned(35), 8),
        (turned(90), 8),
        (SQUARE, 8),  # the same place again
        (turned(0)[[0, 3, 2, 1]], 8),  # turned over
        (turned(0) + [0, 0.5, 0], 8),  # no whole edge in common
    ],
)
def test_corners_on_an_edge_in_common_are_one(second, left):
    assert join(second) == left


def test_corners_of_other_materials_and_beside_walls_stay_apart():
    assert join(turned(0), material=(0, 0, 1, 1)) == 8
    assert join(turned(0), free=False) == 8


def beside(count, free=True):
    """What hangs, of ``count`` rectangles beside the unit square's side x = 1, together as long: places
    of the corners that do, and where on the side."""
    parts = [turned(0) * [1, 1 / count, 1] + [0, i / count, 0] for i in range(count)]
    vertices = np.concatenate([SQUARE, *parts])
    triangles = (QUAD + 4 * np.arange(count + 1)[:, None, None]).reshape(-1, 3)
    number, hanging = joined_unknowns(
        vertices, triangles, triangles, len(vertices), np.zeros(len(triangles), int),
        lambda ways: np.full(len(ways.starts), free),
    )  # fmt: skip
    place = np.zeros((number.max() + 1, 3))
    place[number] = vertices
    ends = (1 - hanging.share[:, None]) * place[hanging.start] + hanging.share[:, None] * place[hanging.end]
    assert place[hanging.corner] == pytest.approx(ends)
    return place[hanging.corner], number.max() + 1


@pytest.mark.parametrize("count", [2, 3, MOST + 1])
def test_corners_between_an_edge_s_ends_hang_on_these(count):
    """``count`` + 1 corners to both sides of the rectangles, and two of the square's left."""
    places, left = beside(count)
    assert sorted(places[:, 1]) == pytest.approx(np.arange(1, count) / count)
    assert left == 2 * (count + 1) + 2
    # Where something stands there none hang; the rectangles are no more one, either.
    assert len(beside(count, free=False)[0]) == 0


def test_corners_hang_on_no_edge_that_has_too_many():
    assert len(beside(MOST + 2)[0]) == 0


def test_what_hangs_on_each_other_in_a_ring_is_found():
    """A pinwheel: each of four corners 4 to 7 is half-way from an outer one, 0 to 3, to the next of the
    ring: 4 = (0 + 5) / 2, and so on around. By the formula for the sum of a geometric series 4 has
    8/15, 4/15, 2/15 and 1/15 of the outer ones."""
    four = np.arange(4)
    free, matrix = spread(Hanging(4 + four, four, 4 + (four + 1) % 4, np.full(4, 0.5)), 8)
    assert free.tolist() == [0, 1, 2, 3]
    assert matrix.toarray()[:4] == pytest.approx(np.eye(4))
    for i in four:
        row = np.roll(np.array([8, 4, 2, 1]) / 15, i)
        assert matrix.toarray()[4 + i] == pytest.approx(row, abs=1e-8)


CUBE = np.array([(x, y, z) for z in (-1, 0) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], float)
SIDES = np.array([(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)])
BOX = CUBE, np.concatenate([(side[[0, 1, 2]], side[[0, 2, 3]]) for side in SIDES])


def test_cubes_side_by_side_are_one_over_their_sharp_edges():
    """Four faces of each go on in the other's over the square between them, which has four vertices,
    and two corners of each of the four faces. Vertices that a cube's faces share are no reason."""
    vertices = np.concatenate([CUBE, CUBE + [1, 0, 0]])
    triangles = np.concatenate([BOX[1], BOX[1] + 8])
    group = np.unique(_by_face(triangles), return_inverse=True)[1].reshape(-1, 3)
    material, free = np.zeros(24, int), lambda ways: np.ones(len(ways.starts), bool)
    points = joined_unknowns(vertices, triangles, triangles, 16, material, free, group)[0]
    corners = joined_unknowns(vertices, triangles, group, 48, material, free)[0]
    assert points.max() + 1 == 16 - 4 and corners.max() + 1 == 48 - 4 * 2


def _by_face(triangles):
    """(n, 3) numbers that corners of two triangles have in common in a face of a box only."""
    return triangles + 100 * (np.arange(len(triangles)) // 2)[:, None]


def level(parts, baked, groups=np.array, **options):
    """A Job for the first ``baked`` parts of a scene with a lamp above the first one."""
    scene = meshes.scene(parts, [[0.5]] * len(parts))
    lamp = PointLamp("Lamp", np.array([0.3, 0.5, 0.8]), np.full(3, 10.0))
    targets = []
    for number in range(baked):
        own = np.flatnonzero(scene.object == number)
        loops = scene.triangles[own].ravel()
        vertex = np.unique(loops, return_inverse=True)[1].reshape(-1).astype(np.int32)
        count = len(loops)
        one_hot = CornerMap(np.arange(count + 1), np.arange(count), np.ones(count), count)
        targets.append(ExportedObject(
            f"Part{number}", int(own[0]), int(own[-1]) + 1, None, one_hot, vertex,
            np.unique(groups(vertex.reshape(-1, 3)), return_inverse=True)[1].reshape(-1),
            n_loops=len(loops),
        ))  # fmt: skip
    settings = Settings(target="vertex", error=0.05, **options)
    return Job(settings, replace(scene, lamps=(lamp,)), tuple(targets), (), (), ())


def by_corner(job):
    """Per target a dict from the part's own vertices to colors."""
    result = run(job)
    found = []
    for target, colors in zip(job.targets, result.colors):
        point = job.settings.domain == "point"
        loops = colors[target.loop_vertex] if point else colors
        faces = {6: QUAD, 12: STRIP[1], 36: BOX[1]}[len(loops)]
        found.append(dict(zip(faces.ravel().tolist(), loops)))
    return found


STRIP = (
    np.concatenate([SQUARE, [(2, 0, 0), (2, 1, 0)]]),
    np.concatenate([QUAD, [(1, 4, 5), (1, 5, 2)]]),
)


@pytest.mark.parametrize("domain", ["corner", "point"])
def test_pieces_of_a_floor_have_the_colors_of_one(domain):
    """Two squares beside each other, as two objects: the corners they have in common are equal to
    the bit, and as bright as those of the same floor as one mesh: both fits are one problem. A
    centimeter apart they are not."""
    first, second = by_corner(level([(SQUARE, QUAD), (turned(0), QUAD)], 2, domain=domain))
    (whole,) = by_corner(level([STRIP], 1, domain=domain))
    assert np.array_equal(first[1], second[0]) and np.array_equal(first[2], second[3])
    assert first[1] == pytest.approx(whole[1], rel=0.05)
    assert second[1] == pytest.approx(whole[4], rel=0.05)
    parts = [(SQUARE, QUAD), (turned(0) + [1e-2, 0, 0], QUAD)]
    first, second = by_corner(level(parts, 2, domain=domain))
    assert abs(first[1] / second[0] - 1).max() > 0.05


@pytest.mark.parametrize("domain", ["corner", "point"])
def test_slabs_side_by_side_are_equal_where_their_tops_meet(domain):
    """Slabs whose tops and sides share vertices: the lamp is above the first, so that apart from each
    other their tops differ where they meet."""
    next_to = CUBE + [1, 0, 0], BOX[1]
    job = level([BOX, next_to], 2, groups=_by_face, domain=domain)
    first, second = (_tops(*pair, domain) for pair in zip(job.targets, run(job).colors))
    assert np.array_equal(first[5], second[4]) and np.array_equal(first[6], second[7])
    assert first[5].min() > 0


def _tops(target, colors, domain):
    """From the vertices of a box's top, as ``BOX`` numbers them, to their colors there."""
    loops = slice(6, 12)
    shown = colors[target.loop_vertex[loops]] if domain == "point" else colors[loops]
    return dict(zip(BOX[1][2:4].ravel().tolist(), shown))


@pytest.mark.parametrize("domain", ["corner", "point"])
def test_a_slab_beside_two_of_half_its_length_shows_the_same(domain):
    """Apart from it, they do not: the corner between the short ones is 20 % off the line between the long
    one's corners."""
    half = turned(0) * [1, 0.5, 1]
    parts = [(SQUARE, QUAD), (half, QUAD), (half + [0, 0.5, 0], QUAD)]
    long, low, high = by_corner(level(parts, 3, domain=domain))
    assert np.array_equal(long[1], low[0]) and np.array_equal(long[2], high[3])
    assert np.array_equal(low[3], high[0])
    assert low[3] == pytest.approx((long[1] + long[2]) / 2, rel=1e-12)
    parts[1:] = [(place + [1e-2, 0, 0], faces) for place, faces in parts[1:]]
    long, low, high = by_corner(level(parts, 3, domain=domain))
    assert abs(low[3] / (long[1] + long[2]) * 2 - 1).min() > 0.05


def test_a_wall_between_pieces_keeps_their_colors_apart():
    wall = np.array([(1, -3, 0), (1, 4, 0), (1, 4, 3), (1, -3, 3)], float), QUAD
    first, second = by_corner(level([(SQUARE, QUAD), (turned(0), QUAD), wall], 2, domain="point"))
    assert first[1].min() > 5 * second[0].max()


def test_a_closed_smooth_mesh_stays_as_it_is():
    """A tetrahedron of which every vertex is one unknown has no edge that could be joined."""
    vertices = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
    triangles = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])
    label = joined_unknowns(
        vertices, triangles, triangles, 4, np.zeros(4, int), lambda ways: np.ones(len(ways.starts), bool)
    )[0]
    assert label.tolist() == [0, 1, 2, 3]
