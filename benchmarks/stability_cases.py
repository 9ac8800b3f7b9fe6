"""What is tried at the extremes: each case measures its deviation from an exact answer.

``CASES`` is the table of docs/stability.md and the list of tests/solver/test_stability.py.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from benchmarks import stability_scenes as scenes
from benchmarks.stability_scenes import part_means, radiosity, worst
from radiosity_addon.solver.form_factors import patch_form_factors
from radiosity_addon.solver.scene import PointLamp
from radiosity_addon.solver.second_kind import solve_second_kind
from tests.solver import exact, meshes


@dataclass(frozen=True)
class Case:
    """``measure()`` gives the deviation from what ``holds``; it must not exceed ``limit``."""

    axis: str
    tried: str
    holds: str
    limit: float
    measure: Callable[[], float]
    slow: bool = False  # not part of the tests

    @property
    def name(self) -> str:
        """For test reports."""
        return f"{self.axis}: {self.tried}"


def furnace(parts, rho: float, error: float = 0.01, divisions: int = 1) -> float:
    """Everything emits 1 − ρ in a closed scene: B = 1 at every receiver."""
    found, _, _ = radiosity(meshes.scene(parts, rho, 1 - rho), error, divisions)
    return worst(found, 1.0)


def sphere(rho: float) -> float:
    """Octants of different emission in a closed sphere: relative RMS deviation from B = q + ρφ."""
    q = np.linspace(0.2, 1.6, 8)
    scene = meshes.sphere_scene(3, np.full((8, 1), rho), q[:, None])
    area = meshes.areas(scene.vertices, scene.triangles)
    expected = exact.closed_sphere(q[scene.object], np.full(len(area), rho), area)
    found, _, _ = radiosity(scene, 0.01, 1)
    return float(np.sqrt(np.mean((found[:, 0] / expected - 1) ** 2)))


def applications(rho: float) -> float:
    """Applications of the operator until a residual of 1e-8, one wall of 24 patches emitting."""
    scene = meshes.scene([meshes.grid(corners, 2) for corners in scenes.CORNERS])
    patch = np.arange(len(scene.triangles))
    factors, _ = patch_form_factors(scene, patch, 1 << 10, 2)
    source = (scene.object == 0).astype(float)
    found = solve_second_kind(lambda x: rho * (factors @ x), source, 1e-8, 400)
    return found.iterations if found.residual <= 1e-8 else np.inf


def open_strips(rho: float) -> float:
    """Sparrow's facing strips, 200 long, mean B."""
    scene = meshes.strips_scene(rho, 200.0, 1)
    return worst(part_means(scene, 0.005, 8).mean(), exact.facing_strips(rho)[2])


def refused() -> float:
    """0 where a closed lossless scene with emission raises the message, 1 where not."""
    try:
        radiosity(meshes.box_scene(reflectance=1.0, exitance=1.0))
    except ValueError as error:
        return 0.0 if "reflectance 1" in str(error) else 1.0
    return 1.0


def brightness(factor: float) -> float:
    """The same room, its lamp ``factor`` times as bright."""
    room = scenes.lamp_room()
    lamp = room.lamps[0]
    bright = replace(room, lamps=(replace(lamp, intensity=lamp.intensity * factor),))
    return worst(part_means(bright) / factor, part_means(room))


def mixed_brightness() -> float:
    """A lamp of 1e30 and one of 1e-30 in one room: the sum is the first, to rounding."""
    room = scenes.lamp_room()
    big = replace(room.lamps[0], intensity=np.full(3, 1e30))
    small = PointLamp("Small", np.array([0.2, 0.2, 0.2]), np.full(3, 1e-30))
    alone = part_means(replace(room, lamps=(big,)))
    return worst(part_means(replace(room, lamps=(big, small))), alone)


def placed(scale: float, offset: float) -> float:
    """The lit room at another scale and place against the unit room at the origin."""
    return worst(part_means(scenes.lamp_room(scale=scale, offset=offset)), part_means(scenes.lamp_room()))


def small_lamp(ratio: float) -> float:
    """A two-sided black square of that edge emits 1 W in a room of ρ = ½ and area 6: of the light
    that arrives half is absorbed, Σ A (1 − ρ) H = 1 and so Σ A B = 1, but for what falls back on
    the lamp itself (order ratio², less than the limit)."""
    exitance = np.zeros((7, 1))
    exitance[6] = 1 / (2 * ratio**2)
    parts = [*scenes.walls(), scenes.quad((0.5, 0.5, 0.5), ratio)]
    scene = meshes.scene(parts, np.array([0.5] * 6 + [0.0])[:, None], exitance)
    return worst(part_means(scene)[:6].sum(), 1.0)


def thin_room(gap: float) -> float:
    """Floor emits 1, top and sides nothing: infinite plates but for a rim as wide as the gap."""
    scene = meshes.box_scene((1, 1, gap), 1, 0.5, np.array([0, 0, 0, 0, 1.0, 0])[:, None])
    floor, top = part_means(scene, 0.005, 8)[4:]
    wanted = exact.infinite_plates(1, 0, 0.5, 0.5), exact.infinite_plates(0, 1, 0.5, 0.5)
    return max(worst(floor, wanted[0]), worst(top, wanted[1]))


def slab() -> float:
    """Opposite faces of 1 × 100 × 0.01."""
    scene = meshes.box_scene((1, 100, 0.01))
    return worst(patch_form_factors(scene, scene.object, 1 << 16)[0][4, 5], 0.9899535671)


def near_plates(gap: float) -> float:
    """Form factor of 1 × 2 rectangles."""
    low = np.array([[0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 2, 0]], float)
    high = low[[0, 3, 2, 1]] + [0, 0, gap]
    scene = meshes.scene([meshes.grid(low, 1), meshes.grid(high, 1)])
    found = patch_form_factors(scene, scene.object, 1 << 15)[0][0, 1]
    return worst(found, exact.parallel_rectangles(1, 2, gap))


def closed_rows(degrees: float) -> float:
    """Rows of a closed prism sum to 1."""
    scene = meshes.scene(scenes.prism(degrees))
    found, _ = patch_form_factors(scene, scene.object, 1 << 12)
    return float(np.abs(found.sum(axis=1) - 1).max())


def sealed(parts, **sun) -> float:
    """Brightest receiver inside a closed room beside the sun."""
    scene = scenes.beside_the_sun(parts, **sun)
    found, receivers, _ = radiosity(scene)
    return float(found[scene.object[receivers.triangle] < len(parts)].max())


def same_as_room(parts, divisions: int = 1) -> float:
    """Mean B of each wall of the lit room, however its walls are cut, against a finer solve of the
    plain room."""
    expected = part_means(scenes.lamp_room(), 0.003)
    return worst(part_means(scenes.lamp_room(parts), 0.01, divisions)[:6], expected)


def lamp_with(extra: list, exitance: list) -> float:
    """Light on the walls of a room under a square lamp with something lying on it."""
    lamp = scenes.quad((0.5, 0.5, 0.8), 0.25)
    means = []
    for parts, values in (([], []), (extra, exitance)):
        rho = np.array([0.5] * 6 + [0.0] * (1 + len(parts)))[:, None]
        glow = np.array([0.0] * 6 + [1.0] + values)[:, None]
        means.append(part_means(meshes.scene([*scenes.walls(), lamp, *parts], rho, glow))[:6].mean())
    return worst(means[1], means[0])


def lamps(count: int) -> float:
    """``count`` lamps of equal power over a floor, total power fixed: half of it is absorbed by
    every reflection, Σ A B = Φ as for one lamp."""
    random = np.random.default_rng(0)
    room = scenes.lamp_room()
    many = tuple(
        PointLamp(f"{i}", place, np.full(3, 1 / (4 * np.pi * count)))
        for i, place in enumerate(random.uniform(0.1, 0.9, (count, 3)))
    )
    return worst(part_means(replace(room, lamps=many), 0.03).sum(), 1.0)


def many_objects(count: int) -> float:
    """A furnace with ``count`` small boxes, an object each."""
    side = int(np.ceil(count ** (1 / 3)))
    places = np.stack(np.meshgrid(*[np.arange(side)] * 3), -1).reshape(-1, 3)[:count]
    low, _ = meshes.box_polygons((0.4 / side,) * 3)
    boxes = []
    for place in (places + 0.3) / side:
        polygons = [meshes.grid(face[::-1] + place, 1) for face in low]
        offsets = 4 * np.arange(6)[:, None, None]
        vertices = np.concatenate([v for v, _ in polygons])
        boxes.append((vertices, (np.stack([t for _, t in polygons]) + offsets).reshape(-1, 3)))
    return furnace([*scenes.walls(1), *boxes], 0.5, 0.03)


def changed(change) -> float:
    """A room with a blob after ``change`` of its scene, against the scene as it was."""
    room = scenes.lamp_room([*scenes.walls(2), meshes.blob(2)])
    lamp = replace(room.lamps[0], position=np.array([0.85, 0.2, 0.85]))  # beside the blob
    room = replace(room, lamps=(lamp,))
    before, after = part_means(room, 0.005), part_means(change(room), 0.005)
    return worst(after[: len(before)], before)


def rotated(scene):
    """Turned about all axes, and mirrored, with the faces turned back to their side."""
    q, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    lamp = scene.lamps[0]
    triangles = scene.triangles[:, ::-1] if np.linalg.det(q) < 0 else scene.triangles
    return replace(scene, vertices=scene.vertices @ q.T, triangles=triangles,
                   lamps=(replace(lamp, position=q @ lamp.position),))  # fmt: skip


def mirrored(scene):
    """x ↦ −x."""
    flip = np.array([-1.0, 1, 1])
    lamp = scene.lamps[0]
    return replace(scene, vertices=scene.vertices * flip, triangles=scene.triangles[:, ::-1].copy(),
                   lamps=(replace(lamp, position=lamp.position * flip),))  # fmt: skip


def shuffled(scene):
    """Triangles in another order, each starting at another corner."""
    order = np.random.default_rng(3).permutation(len(scene.triangles))
    return replace(scene, triangles=np.roll(scene.triangles, 1, axis=1)[order],
                   material=scene.material[order], object=scene.object[order])  # fmt: skip


def noisy(scene):
    """Vertices moved by float32's rounding error."""
    noise = np.random.default_rng(4).uniform(-6e-8, 6e-8, scene.vertices.shape)
    return replace(scene, vertices=scene.vertices + noise)


def _cases():
    box, blob = scenes.walls(1), meshes.blob(3)
    for rho in (0.0, 0.5, 0.9, 0.99, 0.999, 1 - 1e-6):
        yield Case("reflectance", f"furnace around a blob, ρ = {rho:.6g}", "B = 1", 5e-3,
                   lambda rho=rho: furnace([*box, blob], rho))  # fmt: skip
    for rho in (0.5, 0.9, 0.99, 0.999):
        yield Case("reflectance", f"closed sphere, 8 emissions, ρ = {rho:g}", "B = q + ρφ, RMS",
                   1e-2, lambda rho=rho: sphere(rho))  # fmt: skip
    for rho, most in ((0.99, 60), (0.999, 200)):
        yield Case("reflectance", f"operator applications to 1e-8, ρ = {rho:g}", f"≤ {most}", most,
                   lambda rho=rho: applications(rho))  # fmt: skip
    for rho in (0.99, 1.0):
        yield Case("reflectance", f"facing strips (open), ρ = {rho:g}", "Sparrow's mean B", 1e-2,
                   lambda rho=rho: open_strips(rho))  # fmt: skip
    yield Case("reflectance", "ρ = 1, closed, emitting", "refused with a message", 0, refused)
    yield Case("reflectance", "ρ = 1, closed, dark", "B = 0", 0,
               lambda: radiosity(meshes.box_scene(reflectance=1.0))[0].max())  # fmt: skip
    for factor in (1e-30, 1e-6, 1e6, 1e30):
        yield Case("emission", f"lamp × {factor:g}", "B × the same", 1e-6,
                   lambda factor=factor: brightness(factor))  # fmt: skip
    yield Case("emission", "lamps of 1e30 and 1e-30", "as without the second", 1e-2, mixed_brightness)
    for scale in (1e-6, 1e-3, 1.0, 1e3, 1e6):
        for offset in (0.0, 1e6):
            if (scale, offset) != (1.0, 0.0):
                yield Case("scale", f"edge {scale:g}, {offset:g} edges from the origin",
                           "as the unit room", 1e-3,
                           lambda s=scale, o=offset: placed(s, o))  # fmt: skip
    for ratio in (1e-2, 1e-4, 1e-6):
        yield Case("size ratio", f"lamp {ratio:g} of the hall", "Σ A B = Φ", 1e-2,
                   lambda ratio=ratio: small_lamp(ratio))  # fmt: skip
    for level, count in ((5, "2e4"), (8, "1.3e6")):
        yield Case("size ratio", f"{count} triangles in 1e-6 of the volume", "B = 1", 5e-3,
                   lambda level=level: furnace([*box, meshes.blob(level, 0.005)], 0.5, 0.03),
                   slow=level > 5)  # fmt: skip
    yield Case("gaps", "slab 1 × 100 × 0.01", "F = 0.9899535671", 1e-3, slab)
    for gap in (1e-2, 1e-4):
        yield Case("gaps", f"plates {gap:g} apart", "F closed form", 1e-3,
                   lambda gap=gap: near_plates(gap))  # fmt: skip
    yield Case("gaps", "room 1 × 1 × 1e-4", "infinite plates", 5e-3, lambda: thin_room(1e-4))
    for degrees in (0.1, 1.0, 10.0, 90.0, 170.0, 179.0, 179.9):
        yield Case("dihedral angles", f"closed prism, {degrees:g}°", "rows sum to 1", 1e-12,
                   lambda d=degrees: closed_rows(d))  # fmt: skip
        yield Case("dihedral angles", f"sealed prism beside the sun, {degrees:g}°", "B = 0", 0,
                   lambda d=degrees: sealed(scenes.prism(d)))  # fmt: skip
    for count in (100, 1000, 3000):
        yield Case("slivers", f"room of strips, aspect {count}", "as the plain room", 1e-2,
                   lambda n=count: same_as_room([scenes.strips(c, n) for c in scenes.CORNERS]),
                   slow=count > 100)  # fmt: skip
    yield Case("slivers", "room of fans of needles, aspect 300", "as the plain room", 1e-2,
               lambda: same_as_room([scenes.fan(c, 300) for c in scenes.CORNERS]),
               slow=True)  # fmt: skip
    for width in (1e-4, 1e-6):
        yield Case("slivers", f"walls with a seam of aspect {1 / width:.0e}", "as the plain room", 1e-2,
                   lambda w=width: same_as_room([scenes.needles(c, w) for c in scenes.CORNERS],
                                                8))  # fmt: skip
    yield Case("slivers", "furnace of strips, aspect 1000", "B = 1", 5e-3,
               lambda: furnace([scenes.strips(c, 1000) for c in scenes.CORNERS], 0.5))  # fmt: skip
    for what, copy in (("the same", lambda p: p), ("reversed", scenes.reversed_part)):
        yield Case("coplanar", f"every wall twice, {what}", "as once", 1e-2,
                   lambda copy=copy: same_as_room([*scenes.walls(), *map(copy, scenes.walls())],
                                                  2))  # fmt: skip
    yield Case("coplanar", "every wall twice, cut differently", "as once", 1e-2,
               lambda: same_as_room([*scenes.walls(), *scenes.walls(3)], 2))  # fmt: skip
    yield Case("coplanar", "furnace, every wall twice, cut differently", "B = 1", 5e-3,
               lambda: furnace([*scenes.walls(), *scenes.walls(3)], 0.5))  # fmt: skip
    lamp = scenes.quad((0.5, 0.5, 0.8), 0.25)
    back = scenes.reversed_part(lamp)
    for what, extra, glow in (
        ("a reversed dark copy", back, 0.0), ("a reversed lit copy", back, 1.0),
        ("a lit copy", lamp, 1.0), ("a lit copy, cut differently", meshes.grid(
            lamp[0][[0, 1, 3, 2]], 3), 1.0),
    ):  # fmt: skip
        yield Case("coplanar", f"a lamp and {what}", "light as from one", 1e-2,
                   lambda e=extra, g=glow: lamp_with([e], [g]))  # fmt: skip
    yield Case("topology", "sealed box beside the sun", "B = 0", 0, lambda: sealed(scenes.walls()))
    yield Case("topology", "sealed box, low sun", "B = 0", 0,
               lambda: sealed(scenes.walls(), toward=(1, 1, -0.2)))  # fmt: skip
    cuts = (1, 2, 3, 5, 7, 4)
    tees = [meshes.grid(c, n) for c, n in zip(scenes.CORNERS, cuts)]
    yield Case("topology", "T-junctions at every edge", "B = 1", 5e-3, lambda: furnace(tees, 0.5))
    yield Case("topology", "sealed box of T-junctions beside the sun", "B = 0", 0,
               lambda: sealed(tees))  # fmt: skip
    for rho, limit in ((0.5, 5e-3), (0.99, 2e-2)):
        yield Case("furnace", f"80 triangles through each other, ρ = {rho:g}", "B = 1", limit,
                   lambda r=rho: furnace([*scenes.walls(), scenes.soup(80, 1)], r))  # fmt: skip
    for count in (100, 10_000):
        yield Case("many", f"{count} lamps", "Σ A B = Φ", 3e-2, lambda n=count: lamps(n),
                   slow=count > 1000)  # fmt: skip
    for count in (500, 10_000):
        yield Case("many", f"{count} objects", "B = 1", 5e-3, lambda n=count: many_objects(n),
                   slow=count > 1000)  # fmt: skip
    for change in (rotated, mirrored, shuffled, noisy):
        yield Case("invariance", change.__name__, "as before", 1e-2,
                   lambda c=change: changed(c))  # fmt: skip
    yield Case("invariance", "quads cut along the other diagonal", "as before", 1e-2,
               lambda: same_as_room([meshes.grid(c[[1, 2, 3, 0]], 4) for c in scenes.CORNERS],
                                    2))  # fmt: skip


CASES = tuple(_cases())
