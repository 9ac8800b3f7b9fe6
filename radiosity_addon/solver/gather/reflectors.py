"""Reflectors: small bright patches, as the housing of a lamp, whose reflected light is sampled as that of a light.

One ray of thousands ends on such a patch, far away, and brings very much. Where reflectors are few, receivers that are far
from one for its size sample it as a light instead, and rays that end there from so far bring nothing. From nearby, rays find
them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..direct.beams import Split
from ..geometry.footprints import Footprints
from ..lights.context import Context
from ..lights.far_polygons import FarPolygons
from ..lights.flat_shapes import RECTANGLE, TRIANGLE
from ..lights.light_sampler import FEW
from ..lights.polygons import lamp_polygons
from ..ragged import ragged_ranges
from ..transport.lit_patches import light_points, mean_light
from ..transport.patches import Avoided, Patches
from ..transport.radiosity import Radiosity, solve_rows
from ..transport.rows import trace_transport

BRIGHT = 10.0  # radiosity [of the mean over the surface]: brighter patches are reflectors
LARGEST = 0.003  # share [of the surface] of all reflectors: where they have more, rays find them as well
LEAST = 0.01  # share [of what is reflected] of all reflectors: less is not worth samples
FAR = 4.0  # distance [lengths of a patch] from which on it is sampled as a light
# Numbers [points of a patch that may be a reflector, of all of these, of one at most] at which their direct light is found: a power of
# two, at least the first. What few reflectors are off by, all places are.
POINTS, MANY, MOST = 64, 1 << 16, 4096
NEAR = 2.0  # distance [lengths of a patch] of a reflector within which patches are looked at, too, whose few points were dark
MAIN = 0.25  # share [of the direct light that is reflected] of all reflectors: from it on they are lights to rows, too


@dataclass(frozen=True)
class Reflectors:
    """The cells of reflectors as ``lights``, and which entries rays from afar ``avoid``. ``context``: the scene under these
    and all other lights, where they light rows as well; None: the rays of rows find them."""

    lights: FarPolygons
    avoid: Avoided
    context: Context | None = None

    def applied(self, split: Split, radiosity: Radiosity) -> tuple[Split, Radiosity]:
        """The scene with spots that are these lights, too, and the radiosity for rays that avoid them."""
        spots = split.rest.sources.only(np.zeros(0, int)) if split.spots is None else split.spots.sources
        spots = split.rest.under(spots.with_polygons(self.lights))
        return replace(split, spots=spots), self.avoided(radiosity, by_all=False)

    def avoided(self, radiosity: Radiosity, by_all: bool) -> Radiosity:
        """The radiosity for rays that avoid them."""
        receivers = radiosity.patches.receivers.with_left_out()
        avoid = replace(self.avoid, by_all=by_all)
        return replace(radiosity, patches=replace(radiosity.patches, receivers=receivers, avoided=avoid))

    def with_patches(self, patches: Patches) -> Reflectors:
        """The same where other ``patches`` of the receivers are left out."""
        count = patches.receivers.footprints.count
        return replace(self, avoid=patches.avoided_at(self.avoid.distance[:count]))


def lit_as_rows(
    reflectors: Reflectors | None, context: Context, radiosity: Radiosity
) -> tuple[Context, Radiosity]:
    """The lights of rows, and the radiosity for their rays: those given, where no reflectors light rows."""
    if reflectors is None or reflectors.context is None:
        return context, radiosity
    return reflectors.context, reflectors.avoided(radiosity, by_all=True)


def find_reflectors(
    context: Context, radiosity: Radiosity, key: tuple[int, ...]
) -> tuple[Reflectors | None, Radiosity]:
    """The reflectors of a scene under the lights of ``context``, None where there are none or too many, and the radiosity
    with what is known better of them. There are none in scenes with objects that some rays do not meet, or that transmit: lights
    know no such rays. Where they bring most of the light, the radiosity is solved again with them as lights."""
    patches = radiosity.patches
    if radiosity.transport is None or patches.receivers is None:
        return None, radiosity
    if context.transmits.any() or not context.all_rays_alike:
        return None, radiosity
    own = patches.receivers.footprints
    seen, lit, bright = _bright(context, radiosity, key)
    some = seen[bright]
    number, offset = ragged_ranges(np.diff(own.start)[some])
    owner = some[number]
    if len(owner) == 0:
        return None, radiosity
    radiosity = _with_direct_light(radiosity, seen, lit)
    distance = np.full(own.count, np.inf, np.float32)
    distance[some] = FAR * patches.receivers.length[some]
    cells, far = own.start[owner] + offset, distance[owner].astype(float)
    found = Reflectors(_lights(own, cells, radiosity.reflected[owner] / np.pi, far), patches.avoided_at(distance))
    if own.area[some] @ lit[bright].mean(axis=1) < MAIN * _reflected_directly(radiosity, seen, lit):
        return found, radiosity
    found = replace(found, context=context.under(context.sources.with_polygons(found.lights)))
    radiosity = _lit_again(found, context, radiosity, seen, lit, key)
    color = radiosity.reflected[owner] / np.pi
    return replace(found, lights=_lights(own, cells, color, far)), radiosity


def _reflected_directly(radiosity: Radiosity, some: np.ndarray, lit: np.ndarray) -> float:
    """The power of direct light that the patches of receivers reflect, by their rows, but for the patches ``some`` (k,) int: these
    reflect ``lit`` (k, channels)."""
    area, row = radiosity.patches.receivers.footprints.area, radiosity.transport.row
    own, power = np.flatnonzero(row[: len(area)] >= 0), np.zeros(len(area))
    power[own] = radiosity.transport.joined("lit")[row[own]].mean(axis=1)
    power[some] = lit.mean(axis=1)
    return float(area @ power)


def _lit_again(
    found: Reflectors, context: Context, radiosity: Radiosity, some: np.ndarray, lit: np.ndarray, key: tuple[int, ...]
) -> Radiosity:
    """The radiosity solved again with rows that reflectors light as lights, and whose rays avoid them: of a row's few rays hardly
    one finds them. Patches ``some`` (k,) int reflect the direct light ``lit`` (k, channels)."""
    before, known = radiosity.transport, []
    alone = context.under(context.sources.only(np.zeros(0, int)).with_polygons(found.lights))
    for number, block in enumerate(before.blocks):
        light, (_, mine, one) = block.patches.lit.copy(), np.intersect1d(block.patches.patch, some, return_indices=True)
        light[mine] = lit[one]
        light += light_points(alone, block.patches.points, (*key, 1, number))[1]
        known.append((replace(block.patches, lit=light), block.rays))
    under, avoiding = lit_as_rows(found, context, radiosity)
    transport = trace_transport(under, avoiding.patches, known, before.samples, (*key, 2))
    anew = solve_rows(under, avoiding.patches, transport, radiosity.tolerance)
    return replace(anew, patches=radiosity.patches, seconds=radiosity.seconds + anew.seconds)


def _bright(
    context: Context, radiosity: Radiosity, key: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(k,) int: patches of receivers whose fronts are reflectors and those beside them, none of those that glow by themselves; the
    direct light (k, channels) that they reflect; and which are reflectors (k,) bool. What gathered light makes bright may be noise of
    a row's few rays. They are not chosen by the points that light their rows: where these had met more than there is, they would
    be corrected, and where they had met nothing, they would not."""
    transport, patches = radiosity.transport, radiosity.patches
    own = patches.receivers.footprints
    area, row = own.area, transport.row[: own.count]
    mean = area @ radiosity.reflected[: own.count].mean(axis=1, dtype=float) / area.sum()
    some = np.flatnonzero((row >= 0) & (radiosity.other_lit.mean(axis=1) > BRIGHT * mean))
    nothing = some[:0], np.zeros((0, context.channels)), np.zeros(0, bool)
    if area[some].sum() > 2 * LARGEST * area.sum() or len(some) == 0:
        return nothing
    some = _with_those_beside(own, patches.receivers.length, some)
    some = some[row[some] >= 0]
    if radiosity.emitted is not None:
        some = some[~radiosity.emitted[some].any(axis=1)]
    per = int(np.clip(MANY // max(len(some), 1), POINTS, MOST))
    lit = mean_light(context, own, some, 1 << per.bit_length() - 1, key)
    bright = lit.mean(axis=1) > BRIGHT * mean
    power = area[some[bright]] @ lit[bright].mean(axis=1)
    few = area[some[bright]].sum() <= LARGEST * area.sum() and power >= LEAST * mean * area.sum()
    return (some, lit, bright) if few else nothing


def _with_those_beside(own: Footprints, length: np.ndarray, some: np.ndarray) -> np.ndarray:
    """(m,) int: the patches ``some`` (k,) int and those that lie beside them: a beam may light patches of which the few points
    of a row are all dark. ``length`` (P,) is that of the patches."""
    from scipy.spatial import cKDTree

    middle, _ = own.middle()
    found = cKDTree(middle).query_ball_point(middle[some], NEAR * length[some])
    return np.unique(np.concatenate([some, *map(np.array, found)]).astype(int))


def _with_direct_light(radiosity: Radiosity, some: np.ndarray, lit: np.ndarray) -> Radiosity:
    """With patches ``some`` (k,) int that reflect the direct light ``lit`` (k, channels), found at many points, not what the few
    of their rows were lit by: they are few, and all look at them."""
    transport, reflected = radiosity.transport, radiosity.reflected.copy()
    row = transport.row[some]
    reflected[some] = radiosity.solution[row] - transport.joined("lit")[row] + lit
    return replace(radiosity, reflected=reflected)


def _lights(own: Footprints, cells: np.ndarray, color: np.ndarray, nearest: np.ndarray) -> FarPolygons:
    """``cells`` (k,) int of footprints as lights of a ``color`` (k, channels), each from a distance ``nearest`` (k,) on. They are
    divided until they are more than FEW: those are sampled at places, not by formulas of whole polygons."""
    origin, u, v, normal = (array[cells].astype(float) for array in (own.origin, own.u, own.v, own.normal))
    square = own.square[cells]
    while len(origin) <= FEW:
        origin, u, v = _quarters(origin, u, v, square)
        normal, square, color, nearest = (np.repeat(each, 4, axis=0) for each in (normal, square, color, nearest))
    shape = np.where(square, RECTANGLE, TRIANGLE)
    lights = lamp_polygons(color.astype(float), shape, origin, u, v, normal, np.full(len(origin), np.pi))
    return FarPolygons(**vars(lights), nearest=nearest)


def _quarters(
    origin: np.ndarray, u: np.ndarray, v: np.ndarray, square: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Origins and sides (4 k, 3) of the quarters of parallelograms, where ``square`` (k,) bool, and triangles (k, 3)."""
    u, v = u / 2, v / 2
    sign = np.where(square, 1.0, -1.0)[:, None]  # a triangle's inner quarter is turned around
    origins = np.stack([origin, origin + u, origin + v, origin + u + v], 1)
    sides = (np.stack([side, side, side, sign * side], 1) for side in (u, v))
    return tuple(each.reshape(-1, 3) for each in (origins, *sides))
