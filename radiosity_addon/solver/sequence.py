"""The sequence: Scene and receivers in, Solution out. The algorithm, in order.

Depends on every other file of the solver; nothing in the solver depends on it.
"""

from __future__ import annotations

import time

import numpy as np

from .direct import direct_light
from .elements import build_elements
from .embree import Tracer
from .evaluate import evaluate_material
from .footprints import build_footprints
from .gather import gather, shoot, sides_hit
from .geometry import build_geometry
from .lights import build_lights, emissive_triangles
from .progress import Progress, silent
from .receivers import Receivers
from .scene import Scene
from .second_kind import solve_second_kind
from .solution import Solution, Statistics
from .points import footprint_points, grouped_chunks
from .transport import *


def solve(scene: Scene, receivers: Receivers, settings, progress: Progress | None = None,
          n_elements=5000, row_rays=128, gather_rays=32, direct_points=4, element_points=16, seed_rays=8) -> Solution:
    progress = progress or silent
    clock = time.perf_counter
    t0 = clock()
    T = {}
    threads = settings.threads
    geometry = build_geometry(scene.vertices, scene.triangles)
    tracer = Tracer(geometry.vertices, geometry.triangles)
    group = scene.object * len(scene.materials) + scene.material
    elements = build_elements(geometry, group, n_elements)
    where = build_footprints(geometry, receivers, settings.seed, 2)
    T["elements"] = clock() - t0; t0 = clock()
    lights = build_lights(scene, geometry)
    explicit, _ = emissive_triangles(scene)
    sky = None
    # seeds
    def on_receivers(per, *key):
        return lambda chosen, group: footprint_points(where, chosen, per, settings.seed, *key, group)
    pick = np.arange(0, receivers.count, max(1, receivers.count // 10000))
    found = []
    for g, chosen in grouped_chunks(len(pick), 4096):
        hits, _ = shoot(tracer, on_receivers(8, 3)(pick[chosen], g), seed_rays, settings.seed, 3, g)
        found.append(places_hit(sides_hit(elements, hits), hits, elements.miss))
    seeds = join_places(found)
    rho_t = evaluate_material(scene, "reflectance", np.arange(len(scene.triangles)), np.full((len(scene.triangles), 2), 1 / 3))
    rho = np.zeros((elements.count, 3))
    tri_of_cell = np.repeat(np.arange(len(elements.grid)), np.diff(elements.base))
    rho[elements.element] = rho_t[tri_of_cell]
    rho = np.repeat(rho, 2, axis=0)
    transport = trace_transport(tracer, geometry, elements, seeds, rho.max(1) > 0, row_rays, element_points,
                                (settings.seed, 4), threads, lambda f: progress("transport", f), sky)
    T["transport"] = clock() - t0; t0 = clock()
    rows = transport.sides
    D = direct_light(tracer, lights, len(rows), lambda c, g: take_points(transport.points, c), scene.object, (settings.seed, 5), threads, lambda f: progress("direct", f))
    T["element direct"] = clock() - t0; t0 = clock()
    F = form_factors(transport, elements)
    r = rho[rows]
    source = r * (D.irradiance + transport.sky)
    sol = solve_second_kind(lambda x: r * (F @ x), source, 1e-4, 100) if len(rows) else None
    T["solve"] = clock() - t0; t0 = clock()
    table = np.zeros((2 * len(elements.element) + 1, 3), np.float32)
    cr = cell_rows(transport, elements)
    table[cr >= 0] = sol.solution[cr[cr >= 0]]
    dr = direct_light(tracer, lights, where.count, on_receivers(direct_points, 6), scene.object, (settings.seed, 6), threads, lambda f: progress("direct", f))
    T["direct"] = clock() - t0; t0 = clock()
    bounced, open_sky = gather(tracer, elements, where.count, on_receivers(4, 7), table, gather_rays, (settings.seed, 7), threads, lambda f: progress("gather", f), sky)
    T["gather"] = clock() - t0; t0 = clock()
    first = where.start[:-1]
    uv = receivers.corners[first].mean(axis=1)
    reflectance = evaluate_material(scene, "reflectance", receivers.triangle[first], uv)
    emission = evaluate_material(scene, "emission", receivers.triangle[first], uv)
    T["embree"] = tracer.seconds
    return Solution(emission, dr.irradiance + open_sky, bounced, reflectance,
        Statistics(elements=len(rows), rays=tracer.rays, iterations=sol.iterations, residual=sol.residual, seconds=T))
