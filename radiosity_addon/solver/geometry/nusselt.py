"""Nusselt's analog: directions to a polygon whose density is the cosine law itself.

Directions above a point are projected onto its tangent plane: a cosine-weighted solid angle becomes
an area in the unit disk (Nusselt 1928). A polygon's area there lies between arcs of ellipses. It is
cut into sectors at the azimuths of its corners. Within one, the area up to an azimuth has a closed
form, which is inverted by Newton's method; along the radius it is a difference of squares (Peters
2021, "BRDF Importance Sampling for Polygonal Lights", section 3). So every sampled direction stands
for the same irradiance, the whole polygon's: the mean visibility is unbiased, whatever is hidden.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .vectors import cross, dot, lengths, tangents
from .warps import sample_linear

BLOCK = 1 << 11  # number [polygons] at a time: their arrays stay in the cache
STEPS = 2  # number [iterations] of Newton's method: nearly always enough
CLOSE = 1e-5  # error [of a sector's area]: larger ones are reduced by bracketed steps
BRACKETED_STEPS = 30  # number [iterations] of bracketed steps
REVOLUTION = 2 * np.pi  # angle [rad] all around


@dataclass(frozen=True)
class Projected:
    """n polygons above the horizons of n points, each cut into s sectors of the unit disk."""

    axes: list  # of three (3, n): tangent, bitangent, normal
    start: np.ndarray  # (s, n) azimuth [rad]
    width: np.ndarray  # (s, n) [rad], 0 where a sector is none
    arcs: np.ndarray  # (2, 3, s, n): outer and inner, see ``_arcs``
    area: np.ndarray  # (s, n)

    @property
    def total(self) -> np.ndarray:
        """(n,) cosine-weighted solid angles: irradiances of radiance 1."""
        return self.area.sum(axis=0)

    def directions(self, xi: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """(3, k) unit, of density cosθ / total, for the points ``columns`` (k,) int, from ``xi``
        (2, k) in [0, 1)."""
        sector, rest = _sample_sector(self.area[:, columns], xi[0])
        start, width, area = (a[sector, columns] for a in (self.start, self.width, self.area))
        outer, inner = self.arcs[:, :, sector, columns]
        angle, low, high = _azimuth(outer, inner, width, rest, area)
        square = np.clip(low + xi[1] * (high - low), 0, 1)
        radius, azimuth = np.sqrt(square), start + angle
        x, y, z = radius * np.cos(azimuth), radius * np.sin(azimuth), np.sqrt(1 - square)
        tangent, bitangent, normal = (np.take(axis, columns, axis=1) for axis in self.axes)
        return x * tangent + y * bitangent + z * normal


def cosine_toward(rays: list, normal: np.ndarray, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n,) cosine-weighted solid angles of convex polygons above the horizons of unit normals
    (3, n), and (3, n) unit directions to them of that density, from ``xi`` (2, n) in [0, 1).
    ``rays`` (3, n) run to their corners, in order."""
    axes = (*tangents(normal), normal)
    corners = np.stack([np.stack([dot(ray, axis) for axis in axes]) for ray in rays])
    lowest, highest = corners[:, 2].min(axis=0), corners[:, 2].max(axis=0)
    total, direction = np.zeros(normal.shape[1]), np.array(normal)
    for mask, cut in ((lowest >= 0, False), ((lowest < 0) & (highest > 0), True)):
        chosen = np.flatnonzero(mask)
        for some in np.split(chosen, range(BLOCK, len(chosen), BLOCK)):
            part = np.take(corners, some, axis=2)
            mine = project(_above(part) if cut else part, [axis[:, some] for axis in axes])
            total[some] = mine.total
            direction[:, some] = mine.directions(xi[:, some], np.arange(len(some)))
    return total, direction


def project_rays(rays: list, normal: np.ndarray) -> Projected:
    """Convex polygons above the horizons of unit normals (3, n): ``rays`` (3, n) run to their
    corners, in order."""
    axes = [*tangents(normal), normal]
    corners = np.stack([np.stack([dot(ray, axis) for axis in axes]) for ray in rays])
    return project(_above(corners) if (corners[:, 2] < 0).any() else corners, axes)


def project(corners: np.ndarray, axes: list) -> Projected:
    """Convex polygons (k, 3, n), in coordinates along the ``axes`` and above their horizons."""
    corners = corners / np.stack([lengths(corner) for corner in corners])[:, None]
    following = np.concatenate([corners[1:], corners[:1]])
    planes = np.stack([cross(a, b) for a, b in zip(corners, following)])
    sine = np.sqrt(np.stack([dot(plane, plane) for plane in planes]))
    planes /= np.maximum(sine, 1e-300)[:, None]
    along = np.arctan2(sine, np.stack([dot(a, b) for a, b in zip(corners, following)]))
    side = np.sign((planes[:, 2] * along).sum(axis=0))  # 1: they run counterclockwise
    start, width, outer, inner = _sectors(corners, planes, side)
    cosine, sine = np.cos(start), np.sin(start)
    arcs = np.stack([_arcs(planes, edge, cosine, sine) for edge in (outer, inner)])
    end = np.cos(width), np.sin(width)
    area = np.maximum(_reached(arcs[0], *end)[0] - _reached(arcs[1], *end)[0], 0)
    area[outer < 0] = 0
    return Projected(axes, start, width, arcs, area)


def _above(corners: np.ndarray) -> np.ndarray:
    """(2k, 3, n) the part above the horizon of polygons (k, 3, n): both ends of what is left of
    each edge, those of a lost one where the polygon went below."""
    height = corners[:, 2]
    ends, leaving = [], np.zeros(corners.shape[1:])
    for k in range(len(corners)):
        a, b, ha, hb = corners[k - 1], corners[k], height[k - 1], height[k]
        crossing = (ha > 0) != (hb > 0)
        middle = a + np.where(crossing, ha / np.where(crossing, ha - hb, 1), 0) * (b - a)
        middle[2] = np.where(crossing, 0, middle[2])
        ends.append((np.where(ha > 0, a, middle), np.where(hb > 0, b, middle), (ha > 0) | (hb > 0)))
        leaving = np.where(crossing & (ha > 0), middle, leaving)
    return np.stack([np.where(kept, end, leaving) for *both, kept in ends for end in both])


def _sectors(
    corners: np.ndarray, planes: np.ndarray, side: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Azimuths where sectors start (s, n), their widths, and the numbers of the edges that bound
    them outside and inside, (s, n) int, -1: none."""
    azimuth = np.arctan2(corners[:, 1], corners[:, 0])
    start = np.sort(azimuth, axis=0)
    width = np.concatenate([start[1:], start[:1] + REVOLUTION]) - start
    middle = start + width / 2
    middle -= REVOLUTION * (middle > np.pi)
    outer, inner = np.full((2,) + start.shape, -1)
    following = np.concatenate([azimuth[1:], azimuth[:1]])
    for number, (a, b, plane) in enumerate(zip(azimuth, following, planes)):
        ahead = plane[2] > 0  # the azimuth grows from a to b
        low, span = np.where(ahead, a, b), np.where(ahead, b - a, a - b)
        span += REVOLUTION * (span < 0)
        offset = middle - low
        offset += REVOLUTION * (offset < 0)
        covers = (offset < span) & (plane[2] != 0)
        outside = side * plane[2] > 0
        outer[covers & outside] = number
        inner[covers & ~outside] = number
    return start, width, outer, inner


def _arcs(planes: np.ndarray, edge: np.ndarray, cosine: np.ndarray, sine: np.ndarray) -> np.ndarray:
    """(3, s, n) of the edges (s, n) whose planes' unit normals are m: A = |m_z|, and q and p, the
    parts of m along and across the azimuth where the sector starts. A is 0 where there is none."""
    x, y, z = (np.zeros(edge.shape) for _ in range(3))
    for number, plane in enumerate(planes):
        mine = edge == number
        for found, part in zip((x, y, z), plane):
            np.copyto(found, part, where=mine)
    return np.stack([np.abs(z, out=z), x * cosine + y * sine, y * cosine - x * sine])


def _reached(
    arc: np.ndarray, cosine: np.ndarray, sine: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The area ½ ∫ r² below an arc from its sector's start to the azimuth of this ``cosine`` and
    ``sine`` from there, and r² at that. With z² = 1 − r² and m·x = 0, r² = A² / (A² + q²), and
    ½ ∫ r² = ½ A [arctan(A tan ψ)], its two ends joined."""
    a, start, across = arc
    along = start * cosine
    along += across * sine
    square = a * a
    radius = along * along
    radius += square
    np.maximum(radius, 1e-300, out=radius)
    along *= start
    along += square * cosine
    area = np.arctan2(a * sine, along)
    area *= a
    area *= 0.5
    return area, np.divide(square, radius, out=radius)


def _sample_sector(area: np.ndarray, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The sector (n,) that each number in [0, 1) falls into, in proportion to its area, and how
    much of that area (n,) lies before it."""
    cumulative = np.cumsum(area, axis=0)
    level = xi * cumulative[-1] * (1 - 1e-12)
    sector = (cumulative[:-1] <= level).sum(axis=0)
    columns = np.arange(len(sector))
    before = cumulative[sector, columns] - area[sector, columns]
    return sector, np.clip(level - before, 0, area[sector, columns])


def _azimuth(
    outer: np.ndarray, inner: np.ndarray, width: np.ndarray, target: np.ndarray, area: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles (n,) behind the sector's start by which the area has grown to ``target``, from that of
    a radial width that is linear in the azimuth; and inner and outer r² there."""
    one, none = np.ones(len(width)), np.zeros(len(width))
    first = _reached(outer, one, none)[1] - _reached(inner, one, none)[1]
    end = np.cos(width), np.sin(width)
    last = _reached(outer, *end)[1] - _reached(inner, *end)[1]
    angle = width * sample_linear(first, last, target / np.where(area > 0, area, 1))
    for _ in range(STEPS):
        excess, low, high = _excess(outer, inner, angle, target)
        angle -= excess / np.maximum(0.5 * (high - low), 1e-300)
        np.clip(angle, 0, width, out=angle)
    excess, low, high = _excess(outer, inner, angle, target)
    far = np.flatnonzero(np.abs(excess) > CLOSE * area)
    if len(far):
        angle[far] = _bracketed(outer[:, far], inner[:, far], width[far], target[far], angle[far],
                               CLOSE * area[far])
        _, low[far], high[far] = _excess(outer[:, far], inner[:, far], angle[far], target[far])
    return angle, low, high


def _excess(
    outer: np.ndarray, inner: np.ndarray, angle: np.ndarray, target: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n,) the area up to an azimuth less the ``target``, and inner and outer r² there."""
    direction = np.cos(angle), np.sin(angle)
    (far, high), (near, low) = _reached(outer, *direction), _reached(inner, *direction)
    return far - near - target, low, high


def _bracketed(
    outer: np.ndarray, inner: np.ndarray, width: np.ndarray, target: np.ndarray, angle: np.ndarray,
    close: np.ndarray,
) -> np.ndarray:
    """The same angles (n,) where Newton's method fails from the start ``angle`` (n,): its steps, or halves of the
    bracket where a step would leave it, until areas differ from the ``target`` (n,) by no more than ``close`` (n,)."""
    angle, low, high = angle.copy(), np.zeros(len(angle)), width.copy()
    some = np.arange(len(angle))
    for _ in range(BRACKETED_STEPS):
        now = angle[some]
        excess, inside, outside = _excess(outer[:, some], inner[:, some], now, target[some])
        over = excess > 0
        high[some[over]], low[some[~over]] = now[over], now[~over]
        step = now - excess / np.maximum(0.5 * (outside - inside), 1e-300)
        within = (step > low[some]) & (step < high[some])
        going = np.abs(excess) > close[some]
        angle[some] = np.where(~going, now, np.where(within, step, (low[some] + high[some]) / 2))
        some = some[going]
        if len(some) == 0:
            break
    return angle
