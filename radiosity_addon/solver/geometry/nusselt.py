"""Nusselt's analog: directions to a polygon whose density is the cosine law itself.

Directions above a point are projected onto its tangent plane: a cosine-weighted solid angle becomes
an area in the unit disc (Nusselt 1928). A polygon's area there lies between arcs of ellipses. It is
cut into sectors at the azimuths of its corners. Within one, the area up to an azimuth has a closed
form, which is inverted by Newton's method; along the radius it is a difference of squares (Peters
2021, "BRDF Importance Sampling for Polygonal Lights", section 3). So every sampled direction stands
for the same irradiance, the whole polygon's: the mean visibility is unbiased, whatever is hidden.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .vectors import cross, dot, size, tangents

STEPS = 4  # of Newton's method [iterations]: leave an azimuth wrong by < 1e-6 of its sector
TURN = 2 * np.pi


@dataclass(frozen=True)
class Projected:
    """n polygons above the horizons of n points, each cut into s sectors of the unit disc."""

    axes: list  # of three (3, n): tangent, bitangent, normal
    start: np.ndarray  # (s, n) azimuth [rad]
    width: np.ndarray  # (s, n) [rad], 0 where a sector is none
    arcs: np.ndarray  # (2, 3, s, n): outer and inner, see ``_arcs``
    area: np.ndarray  # (s, n)

    @property
    def total(self) -> np.ndarray:
        """(n,) cosine-weighted solid angles: irradiances of radiance 1."""
        return self.area.sum(axis=0)

    def directions(self, xi: np.ndarray) -> np.ndarray:
        """(3, n) unit, of density cosθ / total, from ``xi`` (2, n) in [0, 1)."""
        sector, rest = _chosen(self.area, xi[0])
        columns = np.arange(len(sector))
        start, width, area = (a[sector, columns] for a in (self.start, self.width, self.area))
        outer, inner = self.arcs[:, :, sector, columns]
        turn = _azimuth(outer, inner, width, rest, area)
        low, high = _radius(inner, turn), _radius(outer, turn)
        square = np.clip(low + xi[1] * (high - low), 0, 1)
        radius, azimuth = np.sqrt(square), start + turn
        x, y, z = radius * np.cos(azimuth), radius * np.sin(azimuth), np.sqrt(1 - square)
        tangent, bitangent, normal = self.axes
        return x * tangent + y * bitangent + z * normal


def cosine_toward(rays: list, normal: np.ndarray, xi: np.ndarray):
    """(n,) cosine-weighted solid angles of convex polygons above the horizons of unit normals
    (3, n), and (3, n) unit directions to them of that density, from ``xi`` (2, n) in [0, 1).
    ``rays`` (3, n) run to their corners, in order."""
    axes = (*tangents(normal), normal)
    corners = np.stack([np.stack([dot(ray, axis) for axis in axes]) for ray in rays])
    lowest, highest = corners[:, 2].min(axis=0), corners[:, 2].max(axis=0)
    total, direction = np.zeros(normal.shape[1]), np.array(normal)
    for some, cut in ((lowest >= 0, False), ((lowest < 0) & (highest > 0), True)):
        some = np.flatnonzero(some)
        if len(some):
            part = np.take(corners, some, axis=2)
            mine = project(_above(part) if cut else part, [axis[:, some] for axis in axes])
            total[some], direction[:, some] = mine.total, mine.directions(xi[:, some])
    return total, direction


def project(corners: np.ndarray, axes) -> Projected:
    """Convex polygons (k, 3, n), in coordinates along the ``axes`` and above their horizons."""
    corners = corners / np.stack([size(corner) for corner in corners])[:, None]
    following = np.concatenate([corners[1:], corners[:1]])
    planes = np.stack([cross(a, b) for a, b in zip(corners, following)])
    sine = np.sqrt(np.stack([dot(plane, plane) for plane in planes]))
    planes /= np.maximum(sine, 1e-300)[:, None]
    along = np.arctan2(sine, np.stack([dot(a, b) for a, b in zip(corners, following)]))
    side = np.sign((planes[:, 2] * along).sum(axis=0))  # 1: they run anticlockwise
    start, width, outer, inner = _sectors(corners, planes, side)
    arcs = np.stack([_arcs(planes, edge, start) for edge in (outer, inner)])
    area = np.maximum(_sector_area(arcs[0], width) - _sector_area(arcs[1], width), 0)
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


def _sectors(corners: np.ndarray, planes: np.ndarray, side: np.ndarray):
    """Azimuths where sectors start (s, n), their widths, and the numbers of the edges that bound
    them outside and inside, (s, n) int, -1: none."""
    azimuth = np.arctan2(corners[:, 1], corners[:, 0])
    start = np.sort(azimuth, axis=0)
    width = np.concatenate([start[1:], start[:1] + TURN]) - start
    middle = start + width / 2
    middle -= TURN * (middle > np.pi)
    outer, inner = np.full((2,) + start.shape, -1)
    following = np.concatenate([azimuth[1:], azimuth[:1]])
    for number, (a, b, plane) in enumerate(zip(azimuth, following, planes)):
        ahead = plane[2] > 0  # the azimuth grows from a to b
        low, span = np.where(ahead, a, b), np.where(ahead, b - a, a - b)
        span += TURN * (span < 0)
        apart = middle - low
        apart += TURN * (apart < 0)
        covers = (apart < span) & (plane[2] != 0)
        outside = side * plane[2] > 0
        outer[covers & outside] = number
        inner[covers & ~outside] = number
    return start, width, outer, inner


def _arcs(planes: np.ndarray, edge: np.ndarray, start: np.ndarray) -> np.ndarray:
    """(3, s, n) of the edges (s, n) whose planes' unit normals are m: A = |m_z|, and q and p, the
    parts of m along and across the azimuth ``start``. A is 0 where there is none."""
    m = np.take_along_axis(planes, np.maximum(edge, 0)[:, None], axis=0)
    cosine, sine = np.cos(start), np.sin(start)
    along, across = m[:, 0] * cosine + m[:, 1] * sine, m[:, 1] * cosine - m[:, 0] * sine
    return np.stack([np.where(edge < 0, 0, np.abs(m[:, 2])), along, across])


def _radius(arc: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Squared radius of an arc, ``turn`` [rad] behind its sector's start: with z² = 1 − r² and
    m·x = 0, r² = A² / (A² + q²)."""
    a, along, across = arc
    along = along * np.cos(turn) + across * np.sin(turn)
    return a * a / np.maximum(a * a + along * along, 1e-300)


def _sector_area(arc: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """½ ∫ r² over azimuths from the sector's start: ½ A [arctan(A tan ψ)], its ends joined."""
    a, along, across = arc
    cosine, sine = np.cos(turn), np.sin(turn)
    return 0.5 * a * np.arctan2(
        a * sine, (a * a + along * along) * cosine + along * across * sine
    )


def _chosen(area: np.ndarray, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The sector (n,) that each number in [0, 1) falls into, in proportion to its area, and how
    much of that area (n,) lies before it."""
    cumulative = np.cumsum(area, axis=0)
    level = xi * cumulative[-1] * (1 - 1e-12)
    sector = (cumulative[:-1] <= level).sum(axis=0)
    columns = np.arange(len(sector))
    before = cumulative[sector, columns] - area[sector, columns]
    return sector, np.clip(level - before, 0, area[sector, columns])


def _azimuth(outer, inner, width, target, area) -> np.ndarray:
    """(n,) turns behind the sector's start by which the area has grown to ``target``, from that of
    a radial width that is linear in the azimuth."""
    first = _radius(outer, 0.0) - _radius(inner, 0.0)
    last = _radius(outer, width) - _radius(inner, width)
    part = target / np.where(area > 0, area, 1)
    first, last = np.maximum(first, 0), np.maximum(last, 0)
    root = first + np.sqrt(first * first + part * (last * last - first * first))
    turn = width * np.clip(part * (first + last) / np.maximum(root, 1e-300), 0, 1)
    for _ in range(STEPS):
        slope = 0.5 * (_radius(outer, turn) - _radius(inner, turn))
        error = _sector_area(outer, turn) - _sector_area(inner, turn) - target
        turn = np.clip(turn - error / np.maximum(slope, 1e-300), 0, width)
    return turn
