"""Bakes of two slabs side by side, an image each: what both show along their common edge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.bake.shown import Sheets
from radiosity_addon.bake_job import Job, run
from radiosity_addon.export.exported import ExportedObject
from radiosity_addon.settings import Settings
from radiosity_addon.solver.scene import PointLamp
from verification import meshes

QUAD = np.array([(0, 1, 2), (0, 2, 3)])
SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
WALL = np.array([(1, -3, 0), (1, 4, 0), (1, 4, 3), (1, -3, 3)], float), QUAD
SIZE = 16
EDGE = 0.61  # of the image: the slab's extent; 9.76 texels from 3.12 on
LOW = 0.195


def along_the_edge(parts=(), reflectances=(0.5, 0.5), **options):
    """What both slabs show at places (50,) on their common edge."""
    every = [(SQUARE, QUAD), (SQUARE + [1, 0, 0], QUAD), *parts]
    rho = [[r] for r in reflectances] + [[0.5]] * len(parts)
    scene = meshes.scene(every, rho)
    lamp = PointLamp("Lamp", np.array([0.7, 0.5, 0.5]), np.full(3, 10.0))
    targets = []
    for number in range(2):
        own = np.flatnonzero(scene.object == number)
        place = scene.vertices[scene.triangles[own]][..., :2] - (number, 0)
        targets.append(ExportedObject(
            f"Slab{number}", int(own[0]), int(own[-1]) + 1, LOW + EDGE * place, None, None, None
        ))  # fmt: skip
    settings = Settings(target="image", resolution=SIZE, error=0.02, **options)
    job = Job(settings, replace(scene, lamps=(lamp,)), tuple(targets), (), (), ())
    images = run(job).colors
    sheets, y = Sheets(np.array([SIZE]), np.array([SIZE])), np.linspace(0.02, 0.98, 50)
    shown = []
    for image, x in zip(images, (1, 0)):
        at = SIZE * (LOW + EDGE * np.stack([np.full(50, x), y], 1))
        stencils = sheets.stencils(np.zeros(50, int), at)
        shown.append(stencils.of(image.reshape(-1, 4).astype(float))[:, 0])
    return shown


def test_slabs_side_by_side_show_the_same():
    """The lamp is h = 0.5 above and x = 0.3 beside the edge: light falls as (h² + x²)^-2, by
    4 x / (h² + x²) = 3.5 / m, 36 % a texel of 0.102 m. 0.88 of the outermost texels are covered, so
    that their means, which are shown at the edge, are those of places 0.88 of a texel apart: some
    25 % jump. With the fit they differ by what the weight λ leaves: less than a fiftieth of that."""
    plain = along_the_edge(margin=0)
    fitted = along_the_edge()
    inner = slice(8, 42)  # without a margin the ends of the edge show black too
    jumps = [np.abs(a - b)[inner] / ((a + b) / 2)[inner] for a, b in (plain, fitted)]
    assert jumps[0].max() > 0.05
    assert jumps[1].max() < 0.005


def test_light_does_not_bleed_where_a_wall_stands_on_the_seam():
    """Behind the wall there is nothing but what is reflected from far: less than a hundredth."""
    bright, dark = along_the_edge([WALL])
    assert dark.max() < 0.01 * bright.min()


def test_slabs_of_two_colors_keep_them():
    """Of reflectances 0.8 and 0.1: 8 to 1 by their color. Nothing joins them, so that each shows at
    the edge what it knows 0.38 of a texel before: up to 2 · 0.38 · 36 % = 27 % besides."""
    one, other = along_the_edge(reflectances=(0.8, 0.1), passes=("direct", "color"))
    assert (one / other > 8).all() and (one / other < 8 * 1.28).all()


def test_slabs_of_two_colors_have_the_same_light():
    """Without their color they are one surface."""
    one, other = along_the_edge(reflectances=(0.8, 0.1), passes=("direct",))
    assert one / other == pytest.approx(1, abs=0.005)
