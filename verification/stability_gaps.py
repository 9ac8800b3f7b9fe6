"""Gaps: measures of thin rooms, narrow wedges, and of light that must not leak through walls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from radiosity_addon.settings import Settings
from radiosity_addon.solver.scene import PointLamp
from radiosity_addon.solver.sequence import solve
from radiosity_addon.solver.solution import compose
from radiosity_addon.solver.transport.form_factors import patch_form_factors
from verification import exact, meshes
from verification import stability_scenes as scenes
from verification.stability_scenes import ALL, only, radiosity, worst


def thin_room(gap: float, error: float, plates: bool) -> float:
    """Floor emits 1, top and sides nothing: infinite plates but for a rim as wide as the gap (a
    solve of the six faces with their form factors lies 1.3e-4 from those at a gap of 1e-4).
    Receivers on the ``plates`` alone, or as many on each side."""
    scene = meshes.box_scene((1, 1, gap), 1, 0.5, np.array([0, 0, 0, 0, 1.0, 0])[:, None])
    receivers = meshes.triangle_receivers(scene, 8)
    if plates:
        receivers = only(receivers, scene.object[receivers.triangle] >= 4)
    found = np.pi * compose(solve(scene, receivers, Settings(error=error)), ALL)[:, 0]
    owner = scene.object[receivers.triangle]
    wanted = exact.infinite_plates(1, 0, 0.5, 0.5), exact.infinite_plates(0, 1, 0.5, 0.5)
    return max(worst(found[owner == 4 + k].mean(), wanted[k]) for k in (0, 1))


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


def wedge(degrees: float) -> float:
    """Form factor of two strips 1 wide, 2000 long, that share an edge: 1 − sin(α/2), but for the
    ends, a share of order 1/2000 of what leaves them. In shares of all light that leaves."""
    angle = np.radians(degrees)
    scene = meshes.wedge_scene(angle, 2000.0)
    found = patch_form_factors(scene, scene.object, 1 << 16)[0]
    return float(np.abs(found[[0, 1], [1, 0]] - (1 - np.sin(angle / 2))).max())


def sealed(parts, dark=None, **sun) -> float:
    """Brightest receiver on the ``dark`` parts (all of them) inside closed rooms beside the sun."""
    scene = scenes.beside_the_sun(parts, **sun)
    found, receivers, _ = radiosity(scene)
    dark = range(len(parts)) if dark is None else dark
    return float(found[np.isin(scene.object[receivers.triangle], dark)].max())


def sealed_inside(parts, turned: bool = False) -> float:
    """Brightest receiver inside the unit cube that ``parts`` close off, beside the sun: of those on
    its faces only the ones that look inwards count. ``turned``: all is rotated."""
    scene = meshes.scene(parts, 0.5)
    every = meshes.triangle_receivers(scene, 2)
    corners = scene.vertices[scene.triangles][every.triangle]
    steps = corners[:, 1:] - corners[:, :1]
    point = corners[:, :1] + np.einsum("nkc,ncd->nkd", every.corners, steps)
    inside = ((point > -1e-9) & (point < 1 + 1e-9)).all(axis=(1, 2))
    on_face = (np.abs(point - 0.5) > 0.5 - 1e-6).all(axis=1).any(axis=1)
    inwards = (np.cross(steps[:, 0], steps[:, 1]) * (0.5 - point.mean(axis=1))).sum(axis=1) > 0
    sunny = scenes.sunny(scene, (0.3, 0.2, -1.0))
    found = solve(scenes.turned(sunny) if turned else sunny, every, Settings(error=0.03))
    return float(compose(found, ALL)[inside & (inwards | ~on_face)].max())


def next_room() -> float:
    """Brightest receiver of a dark room whose one wall is also a lit room's: its edges are shared
    by three walls each."""
    both = [(v + [x, 0, 0], t) for x in (0, 1) for v, t in scenes.walls(2)]
    dark = [part for k, part in enumerate(both[6:]) if k != 0]  # without its −x wall, at x = 1
    scene = meshes.scene([*both[:6], *dark], 0.5)
    lamp = PointLamp("Lamp", np.array([0.5, 0.4, 0.7]), np.ones(3))
    found, receivers, _ = radiosity(replace(scene, lamps=(lamp,)))
    return float(found[scene.object[receivers.triangle] >= 6].max())
