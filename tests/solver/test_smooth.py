"""Smoothing: less noise where light is even, no blur where it is not, and an honest error."""

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.solver.adaptive.error_estimator import ErrorEstimator
from radiosity_addon.solver.adaptive.estimate import Surface
from radiosity_addon.solver.filtering.lattice_weights import build_lattices
from radiosity_addon.solver.filtering.smooth import smooth

SIZE = 96  # texels along an edge of a square
GRID = np.stack([np.zeros(SIZE**2), *np.divmod(np.arange(SIZE**2), SIZE)], 1).astype(np.int32)
PLACE = np.stack([GRID[:, 2], GRID[:, 1], GRID[:, 0]], 1) / SIZE
(LATTICE,) = build_lattices(GRID, PLACE, np.tile([0.0, 0, 1], (SIZE**2, 1)))
INSIDE = np.all((GRID[:, 1:] >= 32) & (GRID[:, 1:] < SIZE - 32), axis=1)  # kernels reach 31


def noisy_halves(light, deviation, seed=0):
    """Two halves (n, 1) float32 of ``light`` (n,) with Gaussian noise."""
    random = np.random.default_rng(seed)
    noise = deviation * random.normal(size=(2, len(light), 1))
    return (light[:, None] + noise).astype(np.float32)


def smoothed(light, deviation, seed=0):
    a, b = noisy_halves(light, deviation, seed)
    return smooth([LATTICE], a, b, np.ones_like(a))


def mean_of(found):
    return (found.a + found.b)[:, 0] / 2


@pytest.mark.parametrize("level", range(5))
def test_share_of_noise_that_is_left(level):
    """White noise of variance 1 through the kernels up to a level keeps ``left`` of it, within four
    standard errors of a variance told from as many texels as are independent of each other."""
    random = np.random.default_rng(level)
    variance, repeats = [], 30
    for _ in range(repeats):
        pictures = LATTICE.as_pictures(random.normal(size=(SIZE**2, 1)))
        for step in range(level + 1):
            pictures = LATTICE.step(*pictures, level=step)
        variance.append((LATTICE.read(pictures[0])[INSIDE] ** 2).mean())
    error = 4 * np.std(variance) / np.sqrt(repeats)
    assert np.mean(variance) == pytest.approx(LATTICE.variance_kept(level), abs=error)


def test_even_light_loses_nearly_all_noise():
    """Light that varies linearly stays as it is, so the widest kernel is best everywhere: of the
    noise of the halves' mean 0.17 % of the variance would be left. Choosing by noisy halves costs
    some: 1 % is allowed; a rule that compares averages over different windows leaves 3 %."""
    light = 1 + 0.5 * PLACE[:, 0] - 0.2 * PLACE[:, 1]
    found = smoothed(light, 0.3)
    left = ((mean_of(found) - light)[INSIDE] ** 2).mean() / (0.3**2 / 2)
    assert left < 0.01 and found.touched[INSIDE].all()


def test_even_light_has_no_stains():
    """Places where halves are alike by chance keep their noise, as if the light were so. In the mean of twelve bakes 0.9 % of
    the variance is left; where only the narrow window was asked it was 2.1 %, most of it in spots of a few texels."""
    light = np.ones(SIZE**2)
    left = [((mean_of(smoothed(light, 0.3, seed)) - 1)[INSIDE] ** 2).mean() / (0.3**2 / 2) for seed in range(12)]
    assert np.mean(left) < 0.013


def test_a_small_dark_spot_stays():
    """A disk of twelve texels across, darker by two deviations of the noise: a window twice as wide, in which it has a
    fourth of the share, must not take it away. In the mean of twelve bakes more than four fifths of its depth are left."""
    inside = ((GRID[:, 1:] - (SIZE - 1) / 2) ** 2).sum(1) < 6**2
    light = np.where(inside, 0.8, 1.0)
    depth = [1 - mean_of(smoothed(light, 0.1, seed))[inside].mean() for seed in range(12)]
    assert np.mean(depth) > 0.8 * 0.2


def test_an_edge_stays_sharp():
    """A step of 20 deviations: no texel is off by more than five, as noise alone may be, and next
    to the edge nothing is shared across it (a kernel of any width would move 1/4 of the step)."""
    light = np.where(PLACE[:, 0] < 0.5, 0.0, 1.0)
    found = smoothed(light, 0.05)
    beside = np.abs(GRID[:, 2] - SIZE / 2 + 0.5) < 1
    assert np.abs(mean_of(found) - light).max() < 5 * 0.05 / np.sqrt(2)
    assert np.abs((mean_of(found) - light)[beside].mean()) < 0.05


@pytest.mark.parametrize("deviation", [0.05, 0.2, 0.8])
@pytest.mark.parametrize("waves", [0, 1, 3, 8])
def test_the_error_is_what_is_said(waves, deviation):
    """The estimate of the halves' mean's error, over light with none to eight waves across, in noise
    from a sixth to three times their height: within 20 % of what it is, in the mean of sixteen."""
    x, y = 2 * np.pi * waves * PLACE[:, :2].T
    light = 1 + 0.3 * np.sin(x) * np.cos(y)
    said, true = [], []
    for seed in range(16):
        a, b = noisy_halves(light, deviation, seed)
        surface = Surface(np.ones_like(a), np.zeros_like(a), np.ones(len(a)))
        judge = ErrorEstimator(surface, [LATTICE], ("direct",), 1, None)
        part = judge._smoothed([LATTICE], a, b, np.ones_like(a))
        _, square = part.error(surface.share, np.ones((len(a), 1), np.float32))
        said.append(square.mean())
        true.append((((part.a + part.b)[:, 0] / 2 - light) ** 2).mean())
    assert np.sqrt(np.mean(said)) == pytest.approx(np.sqrt(np.mean(true)), rel=0.2)


def test_straight_edges_are_smoothed_like_lines():
    """Along an edge of the square only pairs on the edge count: through five kernels (1, 2, 1) / 4 a line
    keeps (2m² + 1) / 3m³ of its noise's variance, m = 32; four standard errors of 120 lines, of each of which
    the middle is told."""
    random, middle, kept = np.random.default_rng(0), SIZE // 2, []
    for _ in range(60):
        pictures = LATTICE.as_pictures(random.normal(size=(SIZE**2, 1)))
        for level in range(LATTICE.levels):
            pictures = replace(LATTICE, borders=()).step(*pictures, level=level)
        found = LATTICE.read(pictures[0]).reshape(SIZE, SIZE)
        kept += [found[0, middle] ** 2, found[-1, middle] ** 2]
    m = 32
    line = (2 * m * m + 1) / (3 * m**3)
    assert np.mean(kept) == pytest.approx(line, abs=4 * line * np.sqrt(2 / len(kept)))


def test_an_edge_at_an_angle_is_smoothed_too():
    """A triangle of texels whose slanted edge hardly any pair of neighbors runs along: with
    neighbors on one side it keeps less than half of its noise's variance (kernels up to two texels
    wide would leave 0.15 of it, and some texels are left alone), and dark texels take no light from
    others that they do not see."""
    inside = GRID[:, 1] + 3 * GRID[:, 2] < 2 * SIZE
    (lattice,) = build_lattices(GRID[inside], PLACE[inside], np.tile([0.0, 0, 1], (inside.sum(), 1)))
    edge = ~np.isin((GRID[inside, 1:] + [0, 1]) @ [SIZE, 1], GRID[inside, 1:] @ [SIZE, 1])
    edge &= (GRID[inside, 1] > 2) & (GRID[inside, 2] < SIZE - 1)
    assert edge.sum() > 50
    left = []
    for seed in range(4):
        a, b = noisy_halves(np.ones(inside.sum()), 0.3, seed)
        found = smooth([lattice], a, b, np.ones_like(a))
        left.append(((mean_of(found) - 1)[edge] ** 2).mean() / (0.3**2 / 2))
    assert np.mean(left) < 0.5
    dark = GRID[inside, 2] < 10
    parted = lattice.separated(dark, lambda one, other: np.zeros(len(one), bool))
    for border in parted.borders:
        number = np.full(parted.shape[0] * parted.shape[1], -1)
        number[parted.pixel] = np.arange(len(dark))
        assert not (dark[number[border.pixel]] & ~dark[number[border.other]]).any()


@pytest.mark.parametrize("level", range(5))
def test_ragged_islands_are_averaged(level):
    """No texel gives more than it has, on islands of any shape whose edges cut texels, so that their middles
    are not in line: an average of 0 and 1 lies between."""
    random = np.random.default_rng(7)
    some = np.flatnonzero(random.random(SIZE**2) < 0.7)
    middle = PLACE[some] + random.uniform(-0.2, 0.2, (len(some), 3)) / SIZE * [1, 1, 0]
    (ragged,) = build_lattices(GRID[some], middle, np.tile([0.0, 0, 1], (len(some), 1)))
    values = (random.random((len(some), 20)) < 0.5).astype(float)
    for picture in ragged.step(*ragged.as_pictures(values), level=level):
        found = ragged.read(picture)
        assert found.min() > -1e-6 and found.max() < 1 + 1e-6


def test_nothing_to_share():
    """No light: nothing changes and nothing is touched."""
    none = np.zeros((SIZE**2, 3), np.float32)
    found = smooth([LATTICE], none, none, none + 1)
    assert not found.a.any() and not found.square.any() and not found.touched.any()
