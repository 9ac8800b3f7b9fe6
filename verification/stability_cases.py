"""What is tried at the extremes, axis by axis.

``CASES`` is the list of tests/solver/test_stability.py and, with the real scenes of
``benchmarks.stability_real``, the table of docs/stability.md.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from radiosity_addon.solver.fields import Constant
from verification import meshes
from verification import stability_gaps as gaps
from verification import stability_invariance as invariance
from verification import stability_measures as measures
from verification import stability_scenes as scenes
from verification.stability_scenes import lamp_room, radiosity, walls


@dataclass(frozen=True)
class Case:
    """``measure()`` gives the deviation from what ``holds``; it must not exceed ``limit``."""

    axis: str
    tried: str
    holds: str
    limit: float
    measure: Callable[[], float]
    slow: bool = False  # tested with -m slow only

    @property
    def name(self) -> str:
        """For test reports."""
        return f"{self.axis}: {self.tried}"


def _light():
    """Reflectance and emission."""
    box, blob = walls(1), meshes.blob(3)
    for rho in (0.0, 0.5, 0.9, 0.99, 0.999, 1 - 1e-6):
        yield Case("reflectance", f"furnace around a blob, ρ = {rho:.6g}", "B = 1", 5e-3,
                   partial(measures.furnace, [*box, blob], rho),
                   slow=0.5 < rho <= 0.999)  # fmt: skip
    for rho in (0.5, 0.9, 0.99, 0.999):
        yield Case("reflectance", f"closed sphere, 8 emissions, ρ = {rho:g}", "B = q + ρφ, RMS",
                   1e-2, partial(measures.sphere, rho), slow=rho < 0.999)  # fmt: skip
    for rho, most in ((0.99, 60), (0.999, 200)):
        yield Case("reflectance", f"operator applications to 1e-8, ρ = {rho:g}", f"≤ {most}", most,
                   partial(measures.applications, rho))  # fmt: skip
    for rho in (0.99, 1.0):
        yield Case("reflectance", f"facing strips (open), ρ = {rho:g}", "Sparrow's mean B", 1e-2,
                   partial(measures.open_strips, rho), slow=rho < 1)  # fmt: skip
    white = partial(meshes.box_scene, reflectance=1.0)
    yield Case("reflectance", "ρ = 1, closed, emitting", "refused with a message", 0,
               lambda: measures.refused(white(exitance=1.0), "reflectance 1"))  # fmt: skip
    yield Case("reflectance", "ρ = 1, closed, dark", "B = 0", 0,
               lambda: radiosity(white(), 0.1, 1)[0].max())  # fmt: skip
    for factor in (1e-30, 1e-6, 1e6, 1e30):
        yield Case("emission", f"lamp × {factor:g}", "B × the same", 1e-6,
                   partial(measures.brightness, factor), slow=factor < 1e9)  # fmt: skip
    yield Case("emission", "surfaces of 1e30 and 1e-30", "as without the second", 1e-2,
               measures.bright_and_faint, slow=True)  # fmt: skip
    yield Case("emission", "lamps of 1e30 and 1e-30", "as without the second", 1e-2,
               measures.mixed_brightness)  # fmt: skip


def _size():
    """Scale, size ratio, gaps, angles, slivers."""
    yield from _scale()
    yield from _gaps()
    yield from _slivers()


def _scale():
    """Edges from 1e-6 to 1e6, far from the origin or not, and what is small in a large hall."""
    for scale in (1e-6, 1e-3, 1.0, 1e3, 1e6):
        for offset in (0.0, 1e6):
            if (scale, offset) != (1.0, 0.0):
                yield Case("scale", f"edge {scale:g}, {offset:g} edges from the origin",
                           "as the unit room", 1e-3, partial(measures.placed, scale, offset),
                           slow=(scale, offset) not in ((1e-6, 1e6), (1e6, 0.0)))  # fmt: skip
    for rounded in (False, True):
        yield Case("scale", "edge 1e-6 at 1" + (", in float32" if rounded else ", in float64"),
                   "a warning" if rounded else "no warning", 0,
                   partial(measures.rounding, rounded))  # fmt: skip
    yield Case("scale", "two rooms 1e6 edges apart", "a warning", 0,
               partial(measures.worlds_apart, 1e6), slow=True)  # fmt: skip
    for ratio, note in ((1e-2, ""), (1e-4, ""), (1e-6, " (1 mm in 1 km)")):
        yield Case("size ratio", f"lamp {ratio:g} of the hall{note}", "Σ A B = Φ", 1e-2,
                   partial(measures.small_lamp, ratio), slow=ratio > 1e-6)  # fmt: skip
    for level, count in ((5, "2e4"), (8, "1.3e6")):
        yield Case("size ratio", f"{count} triangles in 1e-6 of the volume", "B = 1", 5e-3,
                   lambda k=level: measures.furnace([*walls(1), meshes.blob(k, 0.005)], 0.5, 0.03),
                   slow=level > 5)  # fmt: skip


def _gaps():
    """Narrow gaps, and angles from needles to nearly flat."""
    # Tested by tests/solver/test_form_factors.py, like most of the wedges below.
    yield Case("gaps", "slab 1 × 100 × 0.01", "F = 0.9899535671", 1e-3, gaps.slab, slow=True)
    for gap in (1e-2, 1e-4):
        yield Case("gaps", f"plates {gap:g} apart", "F closed form", 1e-3,
                   partial(gaps.near_plates, gap))  # fmt: skip
    yield Case("gaps", "room 1 × 1 × 1e-4, baked on its plates to 0.1 %", "infinite plates", 1e-3,
               partial(gaps.thin_room, 1e-4, 0.001, True))  # fmt: skip
    yield Case("gaps", "the same room, ⅔ of its receivers on the rim, to 0.5 %", "infinite plates",
               5e-3, partial(gaps.thin_room, 1e-4, 0.005, False), slow=True)  # fmt: skip
    # At 179.9° one seed in ten finds a place so near to an edge that a ray starts outside.
    for degrees in (0.1, 1.0, 10.0, 90.0, 170.0, 179.0, 179.5):
        yield Case("dihedral angles", f"sealed prism beside the sun, {degrees:g}°", "B = 0", 0,
                   lambda d=degrees: gaps.sealed(scenes.prism(d)),
                   slow=degrees not in (0.1, 90.0, 179.5))  # fmt: skip
    for degrees in (0.1, 1.0, 10.0, 90.0, 170.0, 179.0, 179.9):
        yield Case("dihedral angles", f"wedge, {degrees:g}°", "F = 1 − sin(α/2), of all light",
                   1e-3, partial(gaps.wedge, degrees), slow=degrees not in (0.1, 90.0, 179.9))  # fmt: skip
        yield Case("dihedral angles", f"closed prism, {degrees:g}°", "rows sum to 1", 1e-12,
                   partial(gaps.closed_rows, degrees), slow=True)  # fmt: skip


def _slivers():
    """Walls cut into strips, fans and needles."""
    for count in (100, 1000, 3000):
        yield Case("slivers", f"room of strips, aspect {count}", "as the plain room", 1e-2,
                   partial(_room_of, scenes.strips, count), slow=True)  # fmt: skip
    yield Case("slivers", "room of fans of needles, aspect 300", "as the plain room", 1e-2,
               partial(_room_of, scenes.fan, 300), slow=True)  # fmt: skip
    for width in (1e-4, 1e-6):
        yield Case("slivers", f"walls with a seam of aspect {1 / width:.0e}", "as the plain room",
                   1e-2, partial(_room_of, scenes.needles, width, 8),
                   slow=width > 1e-6)  # fmt: skip
    for count in (100, 1000):
        yield Case("slivers", f"furnace of strips, aspect {count}", "B = 1", 5e-3,
                   lambda n=count: measures.furnace([scenes.strips(c, n) for c in scenes.CORNERS],
                                                    0.5), slow=count > 100)  # fmt: skip


def _room_of(wall, how: float, divisions: int = 1) -> float:
    """The lit room with every wall cut by ``wall(corners, how)``."""
    return measures.same_as_room([wall(c, how) for c in scenes.CORNERS], divisions)


def _shape():
    """Coplanar faces, odd topology, degenerate input."""
    for what, copy in (("the same", lambda p: p), ("reversed", scenes.reversed_part)):
        yield Case("coplanar", f"every wall twice, {what}", "as once", 1e-2,
                   lambda copy=copy: measures.same_as_room([*walls(), *map(copy, walls())], 2),
                   slow=True)  # fmt: skip
    yield Case("coplanar", "every wall twice, cut differently", "as once", 1e-2,
               lambda: measures.same_as_room([*walls(), *walls(3)], 2))  # fmt: skip
    yield Case("coplanar", "furnace, every wall twice, cut differently", "B = 1", 5e-3,
               lambda: measures.furnace([*walls(), *walls(3)], 0.5))  # fmt: skip
    lamp = scenes.quad((0.5, 0.5, 0.8), 0.25)
    back, fine = scenes.reversed_part(lamp), meshes.grid(lamp[0][[0, 1, 3, 2]], 3)
    for what, extra, glow in (
        ("a reversed dark copy", back, 0.0), ("a reversed lit copy", back, 1.0),
        ("a lit copy", lamp, 1.0), ("a lit copy, cut differently", fine, 1.0),
    ):  # fmt: skip
        yield Case("coplanar", f"a lamp and {what}", "light as from one", 1e-2,
                   partial(measures.lamp_with, [extra], [glow]),
                   slow=extra is not fine)  # fmt: skip
    yield from _walls_through_each_other()
    yield from _odd_surfaces()
    yield from _degenerate()


def _walls_through_each_other():
    """Sealed boxes and rooms: T-junctions, and walls that cross."""
    sealed, furnace = gaps.sealed, measures.furnace
    yield Case("topology", "sealed box beside the sun", "B = 0", 0, lambda: sealed(walls()))
    yield Case("topology", "sealed box, low sun", "B = 0", 0,
               lambda: sealed(walls(), toward=(1, 1, -0.2)))  # fmt: skip
    cuts = (1, 2, 3, 5, 7, 4)
    tees = [meshes.grid(c, n) for c, n in zip(scenes.CORNERS, cuts)]
    yield Case("topology", "T-junctions at every edge", "B = 1", 5e-3, lambda: furnace(tees, 0.5))
    yield Case("topology", "sealed box of T-junctions beside the sun", "B = 0", 0,
               lambda: sealed(tees))  # fmt: skip
    through = meshes.blob(2, 0.2, (1.0, 0.5, 0.5))
    yield Case("topology", "sealed box, a blob through its wall", "B = 0", 0,
               lambda: sealed([*walls(), through], range(6)), slow=True)  # fmt: skip
    ground = scenes.plane((0.5, 0.5, 0), (5, 0, 0), (0, 5, 0))
    table = scenes.plane((0.5, 0.5, 0.1), (0.3, 0, 0), (0, 0.3, 0), 6)
    tiles = scenes.plane((0.51, 0.52, 0), (1.5, 0, 0), (0, 1.5, 0), 37)
    for what, parts in (
        ("a house on a ground of two triangles", [*scenes.house(), ground]),
        ("a house on small tiles, not along their edges", [*scenes.house(divisions=4), tiles]),
        ("six planes through each other", [*scenes.house(0.3, 0.3), ground, table]),
        ("the same, of small faces", [*scenes.house(0.3, 0.3, 9), tiles, table]),
    ):
        for turned in (False, True):  # 1e-5 of the sun's: a ray in a million starts beside a wall
            yield Case("topology", f"sealed room: {what}" + ", turned" * turned, "B = 0", 1e-5,
                       partial(gaps.sealed_inside, parts, turned),
                       slow="small" in what)  # fmt: skip


def _odd_surfaces():
    """Surfaces with one side, inverted ones, and some through each other."""
    sealed, furnace = gaps.sealed, measures.furnace
    yield Case("topology", "a Möbius strip", "B = 1", 5e-3,
               lambda: furnace([*walls(1), scenes.moebius()], 0.5))  # fmt: skip
    inside = meshes.blob(2, 0.2)
    inverted = [scenes.reversed_part(wall) for wall in walls()]
    yield Case("topology", "blob in a sealed box of inverted normals", "B = 0", 0,
               lambda: sealed([*inverted, inside], [6]))  # fmt: skip
    yield Case("topology", "a dark room beside a lit one, edges of three walls", "B = 0", 0,
               gaps.next_room)  # fmt: skip
    two = [meshes.blob(2, 0.2), meshes.blob(2, 0.2, (0.6, 0.55, 0.5))]
    yield Case("topology", "two blobs through each other", "B = 1", 5e-3,
               lambda: furnace([*walls(1), *two], 0.5))  # fmt: skip
    for what, part in (
        ("a blob, every other face inverted", scenes.half_reversed(inside)),
        ("an open bowl, faces seen from both sides", scenes.half_reversed(scenes.bowl(inside))),
    ):
        yield Case("topology", what, "B = 1", 5e-3,
                   lambda part=part: furnace([*walls(1), part], 0.5))  # fmt: skip


def _degenerate():
    room = lamp_room(walls(2))
    for what, corners in (
        ("a triangle that is a point", [[0.5] * 3] * 3),
        ("three vertices in a line", [[0.4, 0.5, 0.5], [0.5, 0.5, 0.5], [0.6, 0.5, 0.5]]),
    ):
        yield Case("degenerate", what, "changes nothing", 0,
                   partial(measures.with_triangle, room, corners))  # fmt: skip
    yield Case("degenerate", "every vertex twice", "as once", 1e-2,
               lambda: invariance.changed(invariance.split), slow=True)  # fmt: skip
    vertices = room.vertices.copy()
    vertices[room.triangles[0, 0]] = np.nan
    bad = Constant(np.array([0, np.inf, 0]))
    materials = (replace(room.materials[0], reflectance=bad), *room.materials[1:])
    for what, scene, message in (
        ("a vertex that is no number", replace(room, vertices=vertices), "vertex is not finite"),
        ("a color that is infinite", replace(room, materials=materials), "'part 0' is not finite"),
        ("no triangle", _first(room, 0), "no surface to bake"),
    ):
        yield Case("degenerate", what, "refused with a message", 0,
                   partial(measures.refused, scene, message))  # fmt: skip
    yield Case("degenerate", "one triangle under a lamp", "finite, > 0, no indirect light", 0,
               lambda: measures.alone(_first(room, 1)))  # fmt: skip
    yield Case("degenerate", "no emitter", "B = 0", 0,
               lambda: radiosity(replace(room, lamps=()))[0].max())  # fmt: skip
    for what, rho, exitance in (
        ("emission of 1e-320", 0.5, 1e-320), ("reflectance 5e-324", 5e-324, 1.0),
        ("reflectance −1e-9", -1e-9, 1.0),
    ):  # fmt: skip
        yield Case("degenerate", what, "B as of 0, or the same", 1e-2,
                   partial(measures.box_light, rho, exitance))  # fmt: skip
    flat = replace(room, vertices=np.full_like(room.vertices, 0.3))
    yield Case("degenerate", "all vertices in one place", "refused, or B = 0", 0,
               partial(measures.nothing_there, flat))  # fmt: skip
    copies = (walls(1)[0][0], np.tile(walls(1)[0][1], (50_000, 1)))
    yield Case("degenerate", "a wall 50,000 times", "B = 1", 5e-3,
               lambda: measures.furnace([copies, *walls(1)[1:]], 0.5), slow=True)  # fmt: skip
    yield Case("degenerate", "only emitters", "B = E", 1e-6,
               lambda: measures.furnace(walls(1), 0.0))  # fmt: skip


def _first(scene, count: int):
    """The scene with its first triangles only."""
    return replace(scene, triangles=scene.triangles[:count], material=scene.material[:count],
                   object=scene.object[:count])  # fmt: skip


def _much():
    """Furnaces around real meshes, many of everything, invariance, chance."""
    for rho, limit in ((0.5, 5e-3), (0.99, 2e-2)):
        for count in (20, 2000):
            yield Case("furnace", f"{count} triangles through each other, ρ = {rho:g}", "B = 1",
                       limit,
                       lambda r=rho, n=count: measures.furnace([*walls(), scenes.soup(n, 1)], r),
                       slow=count > 100)  # fmt: skip
        yield Case("furnace", f"suzanne, ρ = {rho:g}", "B = 1", limit,
                   partial(measures.suzanne_furnace, rho), slow=True)  # fmt: skip
    for count in (100, 10_000):
        yield Case("many", f"{count} lamps", "Σ A B = Φ", 3e-2, partial(measures.lamps, count),
                   slow=count > 100)  # fmt: skip
    for count in (500, 10_000):
        yield Case("many", f"{count} objects", "B = 1", 5e-3, partial(measures.many_objects, count),
                   slow=count > 500)  # fmt: skip
    for what, run in (("objects", measures.many_objects), ("lamps", measures.lamps)):
        yield Case("many", f"10,000 {what} against 1,000", "≤ 20 times the time", 20,
                   partial(measures.growth, run, 1000, 10_000), slow=True)  # fmt: skip
    yield Case("many", "Suzanne of 1,007,616 triangles against 3,936", "≤ 1.5 times the elements",
               1.5, partial(measures.elements_of_suzanne, 1, 5), slow=True)  # fmt: skip
    for change in invariance.CHANGES:
        yield Case("invariance", change.__name__.replace("_", " "), "relative error", 1e-2,
                   partial(invariance.changed, change), slow=True)  # fmt: skip
    yield Case("invariance", "quads cut along the other diagonal", "as before", 1e-2,
               lambda: measures.same_as_room([meshes.grid(c[[1, 2, 3, 0]], 4)
                                              for c in scenes.CORNERS], 2))  # fmt: skip
    yield Case("chance", "2000 random scenes", "none fails", 0,
               partial(measures.random_failures, 2000), slow=True)  # fmt: skip


CASES = (*_light(), *_size(), *_shape(), *_much())
