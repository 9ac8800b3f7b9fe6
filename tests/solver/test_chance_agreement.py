"""Points that agree by chance: what they do not show is small beside the error asked for."""

import numpy as np

from radiosity_addon.settings import Settings
from radiosity_addon.solver.adaptive.clock import Clock
from radiosity_addon.solver.adaptive.plan import make_plan
from radiosity_addon.solver.receivers import Receivers
from radiosity_addon.solver.scene import SunLamp
from radiosity_addon.solver.sequence import Options, begin, open_scene
from verification import meshes
from verification.build import Build

SIDE = 80  # number [quads] along the edge of the field
MANY = 1_000_000  # number [receivers] of which none gets more points for being few
STRIPES, HEIGHT, TURN = 20, 0.1, 0.7  # number, height, and angle [rad] to the quads' edges


def field_under_stripes():
    """Quads apart from each other, no texel with a neighbor, below stripes that a sun shines through; and the part of
    each of their triangles (n,) that is lit."""
    random = np.random.default_rng(1)
    build = Build()
    gray = build.material(0.5)
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    for x, y in np.ndindex(SIDE, SIDE):
        build.quad(square + [1.5 * x, 1.5 * y, 0], gray)
    along = np.array([np.cos(TURN), np.sin(TURN), 0])
    across = np.array([-along[1], along[0], 0])
    reach = 3 * SIDE
    edges = np.sort(random.uniform(-reach / 2, reach / 2, 2 * STRIPES)).reshape(-1, 2)
    for low, high in edges:
        ends = [low * across - reach * along, low * across + reach * along]
        ends += [high * across + reach * along, high * across - reach * along]
        build.quad(np.array(ends) + [0, 0, HEIGHT], gray, receives=False)
    scene = build.scene([SunLamp("sun", np.array([0, 0, -1.0]), np.ones(3))])
    corners = scene.vertices[scene.triangles[: 2 * SIDE**2]] @ across
    return scene, lit_parts(corners, edges.ravel())


def lit_parts(corners: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """(n,) of triangles whose ``corners`` (n, 3) lie at these distances along the stripes' normal: what lies beyond an
    even number of ``edges``. A triangle's area up to a distance t is that of two right triangles, quadratic in t."""
    low, middle, high = np.sort(corners, axis=1).T[:, :, None]
    t = np.clip(edges, low, high)
    rising = (t - low) ** 2 / ((middle - low) * (high - low))
    falling = 1 - (high - t) ** 2 / ((high - middle) * (high - low))
    below = np.where(t < middle, rising, falling)
    return 1 - np.diff(below, axis=1)[:, ::2].sum(axis=1)


def test_edges_across_texels_without_neighbors():
    """Texels that a shadow's edge crosses, and whose points all lie on one side of it, get no more of them, and show
    no error. Told is at least half of what is measured, and that is what was asked for or less."""
    asked = 0.01
    scene, lit = field_under_stripes()
    whole = meshes.triangle_receivers(scene)
    kept = whole.triangle < len(lit)
    receivers = Receivers(
        int(kept.sum()), whole.receiver[kept], whole.triangle[kept], whole.corners[kept], whole.square[kept]
    )
    found, told = as_many(scene, receivers, Settings(error=asked, threads=1, passes=("direct",)))
    error = (found - lit) / np.maximum(lit, lit.mean() / 4)
    measured = np.sqrt(np.mean(error**2))
    assert measured < asked and measured / 2 < told, (measured, told)


def as_many(scene, receivers, settings) -> tuple[np.ndarray, float]:
    """Direct irradiance (n,) and its error as told, where the first round has the points that receivers get
    of which there are many."""
    context = open_scene(scene, receivers, settings)
    opened = begin(context, receivers, settings, Options(), Clock())
    plan = make_plan(settings.target_error, MANY, bool(opened.rounds.estimator.neighborhoods))
    assert plan.points < opened.plan.points
    estimate, _ = opened.rounds.run(plan)
    return estimate.direct[:, 0] * estimate.unit * context.unit, estimate.error
