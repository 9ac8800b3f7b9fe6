"""Light blocks: lights in small groups that lie together, the leaves of a light tree.

A block is weighed by where its lights lie in the mean. One that holds a light nearby and others far away weighs next to
nothing there, though the one nearby may bring nearly all light: so lamps that are apart are not cut in pieces, parts of which
share a block.
"""

from __future__ import annotations

import numpy as np

ROOM = 2  # factor [lights]: places in all blocks, at least, so that blocks may end where lights are apart
MANY = 1 << 15  # number [lights] above which blocks have equal numbers of neighbors along Morton's curve: the search would take long
BITS = 10  # number [bits] of each coordinate in Morton's order


def light_blocks(center: np.ndarray, size: int) -> np.ndarray:
    """(m, size) int numbers of the lights at ``center`` (n, 3), filled up with −1, at least one in each; m is a
    power of two, and halves, quarters and so on of the blocks have lights that lie together, too."""
    count, blocks = len(center), 1
    while blocks * size < ROOM * count:
        blocks *= 2
    lights = np.full((blocks, size), -1)
    if count > MANY:
        spread = (np.arange(count) * (blocks * size)) // count  # evenly, so that no block is nearly empty
        lights.reshape(-1)[spread] = morton_order(center)
        return lights
    parts = [(np.arange(count), 0, blocks)]
    while parts:
        some, first, number = parts.pop()
        if number == 1:
            lights[first, : len(some)] = some
        else:
            half = number // 2
            one, other = _halves(some, center, half, half * size)
            parts += [(one, first, half), (other, first + half, half)]
    return lights


def _halves(some: np.ndarray, center: np.ndarray, least: int, most: int) -> tuple[np.ndarray, np.ndarray]:
    """The lights ``some`` (k,) int in two groups of ``least`` to ``most``: cut across the axis along which they spread most, where the
    sum of their squared distances from their groups' means is least."""
    position = center[some] - center[some].mean(axis=0)
    order = np.argsort(position[:, np.argmax((position**2).sum(axis=0))], kind="stable")
    some, position, count = some[order], position[order], len(some)
    cuts = np.arange(max(count - most, least), min(most, count - least) + 1)
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(position, axis=0)])[cuts]
    squares = sum((part**2).sum(axis=1) / n for part, n in ((sums, cuts), (position.sum(axis=0) - sums, count - cuts)))
    cut = cuts[np.argmax(squares)]  # least spread: the squares' sum less this
    return some[:cut], some[cut:]


def morton_order(center: np.ndarray) -> np.ndarray:
    """(n,) int: the order of positions (n, 3) along Morton's curve, on which neighbors are near in space."""
    low, high = center.min(axis=0), center.max(axis=0)
    extent = max(float((high - low).max()), 1e-300)
    voxel = ((center - low) / extent * (2**BITS - 1)).astype(np.int64)
    code = np.zeros(len(center), np.int64)
    for bit in range(BITS):
        for axis in range(3):
            code |= ((voxel[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(code, kind="stable")
