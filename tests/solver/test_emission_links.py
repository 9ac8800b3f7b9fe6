"""Emission that lights only some objects, or that only some shade: closed forms on single floors."""

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.settings import Settings
from radiosity_addon.solver.fields import Constant
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.lights.emissive_faces import emissive_faces
from radiosity_addon.solver.lights.light_sampler import FEW
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.scene import Material, Scene
from radiosity_addon.solver.sequence import solve
from verification import exact, meshes

SQUARE = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
FLOOR, LID, PANEL = (np.array([i]) for i in range(3))
NONE = np.zeros(0, int)
PLACE = np.array([0.1, -0.2, 0.0])


def scene_of(lit=None, shading=None, size: float = 1.0, pieces: int = 1, lid: bool = True) -> Scene:
    """A black unit floor, a black lid ½ above it and a black panel of ``size``, 1 above, that
    glows with radiosity 1, in ``pieces``² squares. A size of 1 is a third of all surface."""
    panel, of_panel = meshes.grid(np.column_stack([SQUARE * size, np.full(4, 1.0)]), pieces)
    quad = np.array([(0, 1, 2), (0, 2, 3)])
    levels = [np.column_stack([SQUARE, np.full(4, z)]) for z in ([0, 0.5] if lid else [0, -5])]
    vertices = np.concatenate([*levels, panel])
    triangles = np.concatenate([quad, quad + 4, of_panel + 8]).astype(np.int32)
    of = np.concatenate([[0, 0, 1, 1], np.full(len(of_panel), 2)]).astype(np.int32)
    black = Constant(np.zeros(3))
    materials = (Material("Black", black), Material("Glow", black, Constant(np.full(3, 1 / np.pi))))
    return Scene(vertices, triangles, (of == 2).astype(np.int32), of, materials,
                 ("Floor", "Lid", "Panel"), emission_objects=(None, None, lit),
                 emission_blockers=(None, None, shading))  # fmt: skip


def floor_light(scene: Scene) -> float:
    """Mean irradiance of the floor's two triangles, in the panel's radiosity: a form factor."""
    solution = solve(scene, meshes.triangle_receivers(scene), Settings(error=0.01))
    return float((solution.direct + solution.indirect)[:2].mean())


@pytest.mark.parametrize("size", [0.2, 1.0])
@pytest.mark.parametrize("lit, shading, share", [
    (None, NONE, 1), (FLOOR, NONE, 1), (LID, NONE, 0), (None, FLOOR, 1), (None, LID, 0),
    (FLOOR, None, 0), (np.array([0, 1]), PANEL, 1), (NONE, NONE, 0),
])  # fmt: skip
def test_only_linked_objects_are_lit_and_shade(lit, shading, share, size):
    """The lid, midway between squares no larger than it is, hides the panel wholly: share 0, else
    the factor of parallel squares. A small panel is sampled explicitly anyway; a large one would be
    left to rays, which know of no links."""
    found = floor_light(scene_of(lit, shading, size))
    if size == 1.0:  # equal squares at a distance of one edge
        expected = exact.parallel_rectangles(1, 1, 1)
    else:  # the mean over a unit floor of the factor of a square of edge 0.2
        middles = (np.indices((40, 40)).reshape(2, -1).T + 0.5) / 40 - 0.5
        panel = np.column_stack([SQUARE * size, np.full(4, 1.0)])[::-1]
        expected = np.mean([
            abs(exact.point_to_polygon(np.array([*x, 0.0]), np.array([0, 0, 1.0]), panel))
            for x in middles
        ])
    assert found == pytest.approx(share * expected, rel=0.01, abs=1e-9)


def test_links_hold_where_points_choose_among_many():
    """A panel in 32 rectangles or more, which only the floor shades: a sampler of its own, whose rays
    meet nothing else."""
    scene = scene_of(None, FLOOR, 0.2, 4)
    sources = build_context(scene, 0, 1, silent).sources
    (sampler,) = sources.samplers
    assert sampler.blocks.size > FEW and sampler.shading == 1
    whole = floor_light(scene_of(None, FLOOR, 0.2))
    assert floor_light(scene) == pytest.approx(whole, rel=0.01)


def test_links_remain_where_there_are_too_many_lights():
    """Beyond the limit emission is left to rays, but for that which is linked."""

    def sampled(scene):
        context = build_context(scene, 0, 1, silent)
        return emissive_faces(scene, context.geometry, context.tracer, most=1)[1]

    free = replace(scene_of(size=0.2), emission_objects=None, emission_blockers=None)
    assert not sampled(free).any()
    assert sampled(scene_of(LID, None, 0.2))[-2:].all()
