"""Light tree: which of many lights to sample at a point, found by going down a tree of them.

Lights that lie near one another share a node, which knows their power, where
they are, and how they face. A point goes down from node to node, each time with probability
proportional to the light it may get from there (Conty Estevez & Kulla 2018, "Importance Sampling
of Many Lights with Adaptive Tree Splitting"): its cost grows with the logarithm of their number.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..array_struct import ArrayStruct
from ..geometry.vectors import columns, dot
from ..workers.parallel import ranges
from .light_blocks import light_blocks

LEAST = 0.02  # share [of a node's power] that is always taken to leave toward a point
SLACK = 0.25  # share [of a node's power, times its apparent size] that is added to that, as its lights face different ways
NEAREST = 1e-6  # squared distance [unit box], at least: float32 is too coarse for smaller ones
PLACES = 1 << 14  # number [descents] at a time: their arrays stay in the cache
WEIGHED = 1 << 15  # number [nodes of the first level, times places] at a time: their arrays do, too


@dataclass(frozen=True)
class Emitters(ArrayStruct):
    """How n lights shine, roughly. ``front`` and ``back`` [W/sr]: radiant intensity along the
    normal and against it; from there it falls with the cosine, unless ``round``: then both are
    half of what goes into every direction."""

    center: np.ndarray  # (n, 3)
    radius: np.ndarray  # (n,)
    normal: np.ndarray  # (n, 3) unit
    front: np.ndarray  # (n,)
    back: np.ndarray  # (n,)
    round: np.ndarray  # (n,) bool


@dataclass(frozen=True)
class Nodes:
    """One level of the tree, n nodes: sums over their lights, which lie in a sphere."""

    power: np.ndarray  # (n,) Σ p, front and back together
    center: np.ndarray  # (n, 3) mean, weighted by power
    radius: np.ndarray  # (n,) of a sphere around all of them
    square: np.ndarray  # (n,) mean squared distance from the center
    first: np.ndarray  # (n, 3) Σ (front − back) normal
    second: np.ndarray  # (n, 3, 3) Σ p normal normalᵀ

    @property
    def count(self) -> int:
        return len(self.power)

    @cached_property
    def rows(self) -> np.ndarray:
        """(15, n) float32: center, first, and of second what differs (xx, yy, zz, xy, xz, yz), power, radius, square."""
        second = [self.second[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        rows = [*self.center.T, *self.first.T, *second, self.power, self.radius, self.square]
        return np.stack(rows).astype(np.float32)


@dataclass(frozen=True)
class LightTree:
    """``levels`` from coarse to fine, each of twice as many nodes; ``blocks`` (n, size) lights of
    each node of the last, filled up with −1."""

    levels: tuple[Nodes, ...]
    blocks: np.ndarray

    def descend(
        self, position: np.ndarray, normal: np.ndarray, extent: np.ndarray, xi: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """For n places (n, 3), each of points within ``extent`` (n,), and k numbers each, ``xi``
        (k, n) in [0, 1): the block each ends in (k, n), the probability of that, and a number in
        [0, 1) to go on with."""
        node, chance, rest = np.empty(xi.shape, np.intp), *np.empty((2, *xi.shape))
        for some in ranges(len(extent), max(1, WEIGHED // self.levels[0].count)):
            importance = _among_all(self.levels[0], position[some], normal[some], extent[some])
            node[:, some], chance[:, some], rest[:, some] = sample_discrete(importance, xi[:, some])
        places = [columns(array).astype(np.float32) for array in (position, normal)]
        places.append(extent.astype(np.float32))
        times = max(1, PLACES // max(xi.shape[1], 1))
        for some in ranges(len(xi), times):
            self._descend_further(node[some], chance[some], rest[some], places)
        return node, chance, rest

    def _descend_further(
        self, node: np.ndarray, chance: np.ndarray, rest: np.ndarray, places: list[np.ndarray]
    ) -> None:
        """From nodes (k, n) of the first level to blocks, in place. ``places``: see ``_of_own``."""
        mine = [np.tile(array, len(node)) for array in places]
        for level in self.levels[1:]:
            first = 2 * node.reshape(-1)
            importance = _of_own(level, np.stack([first, first + 1]), *mine)
            side, share, left = sample_discrete(importance, rest.reshape(1, -1))
            node[:] = (first + side[0]).reshape(node.shape)
            chance *= share.reshape(node.shape)
            rest[:] = left.reshape(node.shape)


def sample_discrete(
    importance: np.ndarray, xi: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """One of c for each of n columns of ``importance`` (c, n) or (c, k, n), in proportion to it, for
    each of k numbers ``xi`` (k, n) in [0, 1): which (k, n), its probability (0 where a column has
    none), and ``xi`` made anew from what is left."""
    cumulative = importance.astype(float)
    for before, row in zip(cumulative, cumulative[1:]):
        row += before
    total = cumulative[-1]
    target = xi * total
    target *= 1 - 1e-12
    which = np.zeros(target.shape, np.uint8)  # c < 256
    for row in cumulative[:-1]:
        which += row <= target
    which = which.astype(np.intp)
    index = (which, np.arange(target.shape[1]))
    if importance.ndim == 3:
        index = (which, np.arange(target.shape[0])[:, None], index[1])
    taken = importance[index].astype(float)
    some = np.where(taken > 0, taken, 1)
    rest = np.clip((target - cumulative[index] + taken) / some, 0, 1 - 1e-12)
    return which, taken / np.where(total > 0, total, 1), rest


def build_tree(emitters: Emitters, top: int, size: int) -> LightTree:
    """A tree whose first level has at most ``top`` nodes and whose last has ``size`` lights in
    each."""
    brightest = max(float((emitters.front + emitters.back).max()), 1e-300)  # float32 takes no 1e39
    emitters = replace(emitters, front=emitters.front / brightest, back=emitters.back / brightest)
    lights = light_blocks(emitters.center, size)
    levels = [_nodes(emitters, lights)]
    while levels[0].count > top:
        levels.insert(0, _halved(levels[0]))
    return LightTree(tuple(levels), lights)


def _nodes(emitters: Emitters, lights: np.ndarray) -> Nodes:
    """The last level: a node for each row of ``lights`` (n, size)."""
    there = lights >= 0
    number = np.maximum(lights, 0)
    power = np.where(there, (emitters.front + emitters.back)[number], 0)
    leaning = np.where(there, (emitters.front - emitters.back)[number], 0)
    normal = emitters.normal[number]
    round_ = emitters.round[number]
    first = np.einsum("ns,nsi->ni", np.where(round_, 0, leaning), normal)
    second = np.einsum("ns,nsi,nsj->nij", np.where(round_, 0, power), normal, normal)
    second += np.where(round_, power, 0).sum(axis=1)[:, None, None] * np.eye(3)
    position = emitters.center[number]
    return _joined(power, position, np.where(there, emitters.radius[number], -np.inf),
                   np.zeros(power.shape), first, second)  # fmt: skip


def _halved(nodes: Nodes) -> Nodes:
    """The level above: every two nodes become one."""
    def pairs(array: np.ndarray) -> np.ndarray:
        return array.reshape(-1, 2, *array.shape[1:])

    return _joined(pairs(nodes.power), pairs(nodes.center), pairs(nodes.radius),
                   pairs(nodes.square), pairs(nodes.first).sum(axis=1),
                   pairs(nodes.second).sum(axis=1))  # fmt: skip


def _joined(
    power: np.ndarray, center: np.ndarray, radius: np.ndarray, square: np.ndarray,
    first: np.ndarray, second: np.ndarray,
) -> Nodes:
    """Nodes of n rows of s members; ``radius`` is −inf where there is no member."""
    total = power.sum(axis=1)
    some = np.where(total > 0, total, 1)
    middle = np.einsum("ns,nsi->ni", power, center) / some[:, None]
    distance = np.linalg.norm(center - middle[:, None], axis=2)
    square = (power * (square + distance**2)).sum(axis=1) / some
    return Nodes(total, middle, (distance + radius).max(axis=1), square, first, second)


def _among_all(
    nodes: Nodes, position: np.ndarray, normal: np.ndarray, extent: np.ndarray
) -> np.ndarray:
    """(count, n) importance of all nodes to places (n, 3) of points within ``extent`` (n,), by
    matrix products: every term is a polynomial of the place."""
    c, n = nodes.center, len(position)
    one = np.ones((n, 1))
    at = (position[:, None, :] * position[:, :, None]).reshape(n, 9)
    pulled = np.einsum("nij,nj->ni", nodes.second, c)
    square = [np.ones((1, len(c))), -2 * c.T, (c**2).sum(axis=1)[None]]
    leaning = [nodes.first.T, -np.einsum("ij,ij->i", nodes.first, c)[None]]
    spread = [nodes.second.reshape(-1, 9).T, -2 * pulled.T, np.einsum("ij,ij->i", pulled, c)[None]]
    facing = [c.T, -np.ones((1, len(c)))]
    terms = [
        (((position**2).sum(axis=1)[:, None], position, one), square),
        ((normal, np.einsum("ij,ij->i", normal, position)[:, None]), facing),
        ((position, one), leaning),
        ((at, position, one), spread),
    ]
    products = (np.vstack(of_node).astype(np.float32).T @ np.hstack(of_point).astype(np.float32).T
                for of_point, of_node in terms)  # fmt: skip
    power, radius, within = nodes.rows[12:, :, None]
    return _importance(*products, power, radius + extent.astype(np.float32), within)


def _of_own(
    nodes: Nodes, number: np.ndarray, position: np.ndarray, normal: np.ndarray, extent: np.ndarray
) -> np.ndarray:
    """(c, n) float32 importance of nodes ``number`` (c, n) to places, each its own: ``position`` and ``normal``
    (3, n), ``extent`` (n,), float32."""
    found = [np.take(row, number) for row in nodes.rows]
    away = x, y, z = [mine - center for mine, center in zip(position, found[:3])]
    xx, yy, zz, xy, xz, yz = found[6:12]
    spread = x * (xx * x + 2 * (xy * y + xz * z)) + y * (yy * y + 2 * yz * z) + zz * z * z
    power, radius, within = found[12:]
    return _importance(
        dot(away, away), -dot(away, normal), dot(away, found[3:6]), spread, power, radius + extent, within
    )


def _importance(
    square: np.ndarray, facing: np.ndarray, leaning: np.ndarray, spread: np.ndarray,
    power: np.ndarray, radius: np.ndarray, within: np.ndarray,
) -> np.ndarray:
    """Rough irradiance of nodes, above 0 wherever any may arrive.

    With w the unit vector to the point, light leaves as Σ front max(n·w, 0) + back max(−n·w, 0)
    = ½ Σ (front − back) n·w + ½ Σ p |n·w|; the last sum is at most √(Σp · wᵀ(Σ p n nᵀ)w).
    ``facing`` and ``leaning`` are still multiplied by the distance, ``spread`` by its square.
    """
    power = power.astype(np.float32)
    square = np.maximum(square, NEAREST).astype(np.float32, copy=False)
    inverse = 1 / np.sqrt(square)
    size = np.minimum(radius.astype(np.float32) * inverse, 1)
    leaving = np.sqrt(np.maximum(spread * power, 0))
    leaving += leaning
    leaving *= 0.5 * inverse
    np.clip(leaving, 0, power, out=leaving)
    leaving += (LEAST + SLACK * size) * power
    arriving = facing * inverse
    arriving += size + np.float32(1e-3)
    np.clip(arriving, 0, 1, out=arriving)
    square += within.astype(np.float32)
    leaving *= arriving
    leaving /= square
    return leaving
