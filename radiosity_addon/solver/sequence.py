"""The sequence: Scene and receivers in, Solution out. The algorithm, in order.

Depends on every other file of the solver; nothing in the solver depends on it.
"""

from __future__ import annotations

import time

import numpy as np

from .direct import direct_light
from .elements import build_elements, element_receivers
from .embree import Tracer
from .evaluate import evaluate_material
from .footprints import build_footprints, grouped_chunks
from .gather import gather, trace_footprints
from .geometry import build_geometry
from .lights import build_lights, emissive_triangles
from .progress import Progress, silent
from .receivers import Receivers
from .scene import Scene
from .second_kind import solve_second_kind
from .solution import Solution, Statistics
from .transport import cell_rows, form_factors, sides_of_elements, trace_transport


def solve(scene: Scene, receivers: Receivers, settings, progress: Progress | None = None,
          n_elements=5000, row_rays=128, gather_rays=32, direct_points=4, element_points=16) -> Solution:
    progress = progress or silent
    clock = time.perf_counter
    t0 = clock()
    T = {}
    threads = settings.threads
    geometry = build_geometry(scene.vertices, scene.triangles)
    tracer = Tracer(geometry.vertices, geometry.triangles)
    group = scene.object * len(scene.materials) + scene.material
    elements = build_elements(geometry, group, n_elements)
    sides = element_receivers(elements)
    # both sides: front and back
    twice = Receivers(
        count=2 * sides.count,
        receiver=np.concatenate([2 * sides.receiver, 2 * sides.receiver + 1]),
        triangle=np.tile(sides.triangle, 2), corners=np.tile(sides.corners, (2, 1, 1)),
        square=np.tile(sides.square, 2))
    order = np.argsort(twice.receiver, kind="stable")
    twice = Receivers(twice.count, twice.receiver[order].astype(np.int32), twice.triangle[order], twice.corners[order], twice.square[order])
    sided = build_footprints(geometry, twice, settings.seed, 1, back=np.arange(twice.count) % 2 == 1)
    where = build_footprints(geometry, receivers, settings.seed, 2)
    T["elements"] = clock() - t0; t0 = clock()
    lights = build_lights(scene, geometry)
    explicit, _ = emissive_triangles(scene)
    sky = None
    # seeds
    pick = np.arange(0, receivers.count, max(1, receivers.count // 20000))
    seen = np.zeros(2 * len(elements.element) + 1, bool)
    for g, chosen in grouped_chunks(len(pick), 4096):
        s, _ = trace_footprints(tracer, elements, where, pick[chosen], 4, (settings.seed, 3), g)
        seen[s.ravel()] = True
    seeds = np.unique(sides_of_elements(elements, np.flatnonzero(seen[:-1])))
    cells_first = sided.start[:-1]
    tri = sided.triangle[cells_first]
    rho = evaluate_material(scene, "reflectance", tri, np.full((len(tri), 2), 1 / 3))
    transport = trace_transport(tracer, elements, sided, seeds, rho.max(1) > 0, row_rays,
                                (settings.seed, 4), threads, lambda f: progress("transport", f), sky)
    T["transport"] = clock() - t0; t0 = clock()
    rows = transport.sides
    D = direct_light(tracer, lights, sided.subset(rows), scene.object, element_points, (settings.seed, 5), threads, lambda f: progress("direct", f))
    T["element direct"] = clock() - t0; t0 = clock()
    F = form_factors(transport, elements)
    r = rho[rows]
    source = r * (D.irradiance + transport.sky)
    sol = solve_second_kind(lambda x: r * (F @ x), source, 1e-4, 100) if len(rows) else None
    T["solve"] = clock() - t0; t0 = clock()
    table = np.zeros((2 * len(elements.element) + 1, 3), np.float32)
    cr = cell_rows(transport, elements)
    table[cr >= 0] = sol.solution[cr[cr >= 0]]
    dr = direct_light(tracer, lights, where, scene.object, direct_points, (settings.seed, 6), threads, lambda f: progress("direct", f))
    T["direct"] = clock() - t0; t0 = clock()
    bounced, open_sky = gather(tracer, elements, where, table, gather_rays, (settings.seed, 7), threads, lambda f: progress("gather", f), sky)
    T["gather"] = clock() - t0; t0 = clock()
    first = where.start[:-1]
    uv = receivers.corners[first].mean(axis=1)
    reflectance = evaluate_material(scene, "reflectance", receivers.triangle[first], uv)
    emission = evaluate_material(scene, "emission", receivers.triangle[first], uv)
    T["embree"] = tracer.seconds
    return Solution(emission, dr.irradiance + open_sky, bounced, reflectance,
        Statistics(elements=len(rows), rays=tracer.rays, iterations=sol.iterations, residual=sol.residual, seconds=T))
