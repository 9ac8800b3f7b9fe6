"""Random scenes: whatever they hold, the solver must not crash, invent light or lose a number.

Hypothesis draws the structure, which it can simplify; a seed of it gives the coordinates.
"""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass, replace

import hypothesis
import numpy as np
from hypothesis import HealthCheck, given
from hypothesis import strategies as st

from radiosity_addon.settings import Settings
from radiosity_addon.solver.fields import Constant, CornerColors, Texture
from radiosity_addon.solver.receivers import Receivers
from radiosity_addon.solver.scene import AreaLamp, Material, PointLamp, Scene, Sky, SunLamp
from radiosity_addon.solver.sequence import solve
from radiosity_addon.solver.solution import Solution, compose
from verification import meshes
from verification.stability_scenes import ALL, CORNERS, only

ERROR = 2.0  # asked of every solve: many cheap ones find more than few good ones
ODD = ("degenerate", "collinear", "twice", "reversed", "sliver", "tiny")
BAD = ("vertex", "reflectance", "emission", "lamp", "sky")  # what is made NaN or infinite
LAMPS = ("point", "soft", "spot", "sun", "wide sun", "rectangle", "ellipse", "spread")


@dataclass(frozen=True, repr=False)
class Random:
    """A scene, who gets a color, and what must be said of it: a pattern, or None."""

    scene: Scene
    receivers: Receivers
    refusal: str | None
    seed: int


@st.composite
def random_scenes(draw) -> Random:
    """Triangles anywhere, with or without a room around, odd ones among them; lights of any kind
    and strength; any reflectance; now and then a number that is none."""
    seed = draw(st.integers(0, 2**32 - 1))
    random = np.random.default_rng(seed)
    parts = [_soup(random, draw(st.integers(1, 12)))]
    parts += [_odd(random, what) for what in draw(st.lists(st.sampled_from(ODD), max_size=3))]
    if draw(st.booleans()):
        parts += [meshes.grid(corners, 1) for corners in CORNERS]
    scale = 10.0 ** draw(st.sampled_from((0, -6, -3, 3, 6)))
    scene = meshes.scene(parts)
    materials = tuple(
        Material(f"part {i}", *(draw(_fields(what, len(scene.triangles))) for what in QUANTITIES))
        for i in range(len(parts))
    )
    types = draw(st.lists(st.sampled_from(LAMPS), max_size=5))
    lamps = tuple(_lamp(random, what, draw(_strengths)) for what in types)
    scene = _placed(replace(scene, materials=materials, lamps=lamps, sky=draw(_skies())), scale,
                    draw(st.sampled_from((0.0, 0.0, 1e6))))  # fmt: skip
    if draw(st.integers(0, 4)) == 0:
        scene = replace(
            scene,
            casts_shadow=random.random(len(parts)) < 0.5,
            visible=random.random(len(parts)) < 0.5,
            lamp_objects=tuple(random.permutation(len(parts))[:2] for _ in lamps),
        )
    receivers = _receivers(random, scene, draw(st.sampled_from((1, 2))), draw(st.booleans()))
    bad = draw(st.sampled_from((None,) * 15 + BAD))
    scene, refusal = _spoiled(scene, bad, draw(st.sampled_from((np.nan, np.inf, -np.inf))))
    return Random(scene, receivers, refusal, draw(st.integers(0, 3)))


QUANTITIES = ("reflectance", "emission", "transmittance")
_strengths = st.sampled_from((1.0, 0.0, 1e-30, 1e-6, 1e6, 1e30))
_shares = st.sampled_from((0.0, 0.5, 0.9, 0.99, 0.999999, 1.0))


@st.composite
def _fields(draw, what: str, count: int):
    """A field of that kind on ``count`` triangles."""
    if what == "transmittance" and draw(st.integers(0, 5)):
        return Constant(np.zeros(3))
    if what == "emission" and draw(st.booleans()):
        return Constant(np.zeros(3))
    level = draw(_strengths if what == "emission" else _shares)
    random = np.random.default_rng(draw(st.integers(0, 99)))
    color = level * np.where(random.random(3) < 0.3, random.random(3), 1.0)
    form = draw(st.sampled_from(("constant", "constant", "corners", "texture")))
    if form == "constant":
        return Constant(color)
    if form == "corners":
        return CornerColors((color * random.random((count, 3, 1))).astype(np.float32))
    uv = random.normal(0.5, 1.0, (count, 3, 2)).astype(np.float32)
    return Texture(
        random.random((4, 8, 3)).astype(np.float32), uv,
        draw(st.sampled_from(("REPEAT", "EXTEND", "CLIP", "MIRROR"))),
        draw(st.sampled_from(("Linear", "Closest"))), color,
    )  # fmt: skip


@st.composite
def _skies(draw):
    """None, a constant, or an image with a bright spot."""
    form, strength = draw(st.sampled_from((None, None, "constant", "image"))), draw(_strengths)
    if form is None:
        return None
    pixels = np.full((1, 1, 3) if form == "constant" else (8, 16, 3), strength, np.float32)
    if form == "image":
        pixels[5, 3] = min(1e4 * strength, 1e38)
    return Sky(pixels)


def _soup(random, count: int):
    """``count`` triangles through each other."""
    center = random.uniform(0.2, 0.8, (count, 1, 3))
    corners = center + random.uniform(-0.2, 0.2, (count, 3, 3))
    return corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


def _odd(random, what: str):
    """Something that a clean mesh does not have."""
    a, b, c = random.uniform(0.1, 0.9, (3, 3))
    once = np.array([[0, 1, 2]])
    if what == "degenerate":
        return np.array([a, a, b]), once
    if what == "collinear":
        return np.array([a, b, (a + b) / 2]), once
    if what == "twice":
        return np.array([a, b, c]), np.concatenate([once, once])
    if what == "reversed":
        return np.array([a, b, c]), np.concatenate([once, once[:, ::-1]])
    if what == "sliver":
        return np.array([a, b, b + 1e-6 * (c - b)]), once
    return a + 1e-6 * np.array([a, b, c]), once  # tiny


def _lamp(random, what: str, strength: float):
    """A lamp somewhere in the unit box."""
    position, toward = random.uniform(0.1, 0.9, 3), random.normal(size=3)
    toward /= np.linalg.norm(toward)
    color = np.full(3, strength)
    if what in ("point", "soft", "spot"):
        radius = 0.0 if what == "point" else 10 ** random.uniform(-6, 1)
        axis = toward if what == "spot" else None
        cone, blend = random.uniform(0, np.pi), random.random()
        return PointLamp(what, position, color, radius, axis, cone, blend)
    if what in ("sun", "wide sun"):
        return SunLamp(what, toward, color, 0.0 if what == "sun" else random.uniform(0, np.pi))
    u = np.cross(toward, random.normal(size=3)) * 10 ** random.uniform(-6, 1)
    v = np.cross(toward, u) * random.uniform(0.01, 1)
    spread = random.uniform(0, np.pi) if what == "spread" else np.pi
    return AreaLamp(what, position, u, v, toward, color, what == "ellipse", spread)


def _placed(scene: Scene, scale: float, offset: float) -> Scene:
    """The scene at another size and place; lamps keep their colors."""
    lamps = []
    for lamp in scene.lamps:
        if isinstance(lamp, PointLamp):
            lamp = replace(lamp, position=(lamp.position + offset) * scale,
                           radius=lamp.radius * scale)  # fmt: skip
        elif isinstance(lamp, AreaLamp):
            lamp = replace(lamp, center=(lamp.center + offset) * scale, u=lamp.u * scale,
                           v=lamp.v * scale)  # fmt: skip
        lamps.append(lamp)
    return replace(scene, vertices=(scene.vertices + offset) * scale, lamps=tuple(lamps))


def _receivers(random, scene: Scene, divisions: int, texels: bool) -> Receivers:
    """Some triangles that have an area, cut; as if texels of an image, or not."""
    every = meshes.triangle_receivers(scene, divisions)
    corners = scene.vertices[scene.triangles]
    corners = (corners - corners.min((0, 1))) / max(np.ptp(corners, axis=(0, 1)).max(), 1e-300)
    area = meshes.areas(corners.reshape(-1, 3), np.arange(corners.size // 3).reshape(-1, 3))
    kept = only(every, (area[every.triangle] > 0) & (random.random(every.count) < 0.9))
    places = np.arange(kept.count)
    grid = np.stack([places // 40, places // 8 % 5, places % 8], 1).astype(np.int32)
    return replace(kept, grid=grid if texels and kept.count else None)


def _spoiled(scene: Scene, bad: str | None, value: float) -> tuple[Scene, str | None]:
    """The scene with a number that is none, and how it must be refused."""
    if bad == "vertex":
        vertices = scene.vertices.copy()
        vertices[scene.triangles[0, 0], 1] = value
        return replace(scene, vertices=vertices), "a vertex is not finite"
    if bad in QUANTITIES:
        first = replace(scene.materials[0], **{bad: Constant(np.array([0, value, 0]))})
        return replace(scene, materials=(first, *scene.materials[1:])), f"the {bad} of material"
    if bad == "lamp":
        lamp = PointLamp("Bad", np.array([0, value, 0]), np.ones(3))
        return replace(scene, lamps=(lamp,), lamp_objects=None), "the position of lamp 'Bad'"
    if bad == "sky":
        return replace(scene, sky=Sky(np.full((1, 1, 3), value, np.float32))), "the sky has pixels"
    return scene, None


def check(random: Random, solve=solve) -> None:
    """Solve, strictly. AssertionError where light is negative, no number, or from nowhere."""
    settings = Settings(error=ERROR, threads=1, seed=random.seed)
    try:
        with np.errstate(all="raise"), warnings.catch_warnings():
            warnings.simplefilter("error")
            solution = solve(random.scene, random.receivers, settings)
    except ValueError as error:
        assert re.search(random.refusal or _fair_refusals(random), str(error)), error
        return
    assert random.refusal is None, f"not refused: {random.refusal}"
    _check_light(random, solution)


def _fair_refusals(random: Random) -> str:
    """What may be said of a scene of numbers."""
    if random.receivers.count == 0:
        return "there is no surface to bake"
    return "reflects all light"


def _check_light(random: Random, solution: Solution) -> None:
    for name in ("emission", "direct", "indirect", "diffuse"):
        values = getattr(solution, name)
        assert values.shape == (random.receivers.count, 3), name
        assert np.isfinite(values).all() and (values >= 0).all(), name
    assert np.isfinite(compose(solution, ALL)).all()
    energy = solution.statistics.energy
    assert all(np.isfinite(value) and value >= 0 for value in energy.values()), energy
    lost = energy["emitted"] - energy["absorbed"] - energy["escaped"]
    assert abs(lost) <= 1e-9 * energy["emitted"], energy


def run(count: int) -> None:
    """Check ``count`` random scenes; raise for the simplest that fails."""

    @hypothesis.settings(
        max_examples=count, deadline=None, database=None, derandomize=True,
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @given(random_scenes())
    def every(random):
        check(random)

    every()
