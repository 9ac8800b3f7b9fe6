"""Texel fit: texels beside seams as the best fit of what is shown to the light. NumPy and SciPy.

Between texels engines show a bilinear picture. Inside an island a texel's mean is a good value for
it. Beside seams, where the surface goes on in another place of an image, it is not: a texel that lies
partly on the surface knows the light at the middle of that part, not at its own, those of the margin
know nothing, and the two sides show what each makes of it. The values x of these texels minimize

    Σ_t a_t |(P x)_t − L_t|² + λ Σ_s l_s |(A x)_s − (B x)_s|² + ε |x − x₀|²

each square over that of max(L, L̄/4), L the light there and L̄ its mean, as errors are judged: a texel of the margin
between a dark island and a bright one is seen by both, and would else have the bright one's light. P shows x at the middles of texels' covered parts, a texels each, of which L are the means: exact for
light that is linear. A and B show both sides of seams at places that stand for l texels each. A jump
of j counts three times the least error that it makes on the surface: j/2 at the seam that falls to 0
within a texel to both sides, whose square is 2 (j/2)² ∫₀¹ (1 − t)² dt = j²/6. x₀ are the means; in
the margin they are what is known of the light that the seams see, and L is that of these seams: the nearest texel may be
another island's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix, diags, vstack

from ..solver.adaptive.relative_error import area_shares, mean_over, scale_of
from .border_samples import SeamSamples
from .bounded import solve_bounded
from .shown import SEEN, Sheets, Stencils

EQUAL = 3 / 6  # weight λ [texels per texel of length]: what a jump over a seam costs; eyes see steps first
# Weights ε [texels]: how much texels stay what they are without the fit, on the surface and in the margin. With less, texels
# of the margin that seams hardly see swing far beyond the light, and may show a hue of their own beside the seam.
STAY, STAY_MARGIN = 1e-4, 4e-4
TOLERANCE = 1e-4  # residual [relative]: far below what anybody sees
LEEWAY = 0.5  # excess [of the light's span nearby] of a value over the light, at most
NEARBY = 2  # distance [texels] up to which the light's span is taken


@dataclass(frozen=True)
class Known:
    """What is known of the light: ``mean`` over the parts of texels that lie on the surface."""

    texel: np.ndarray  # (k,) int64, ascending
    middle: Stencils  # (k,) what is shown in the middle of the part
    share: np.ndarray  # (k,) of the texel that it is, at most 1
    mean: np.ndarray  # (k, 3)


def fit_texels(
    sheets: Sheets, known: Known, seams: SeamSamples, pixels: np.ndarray, free: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Numbers (m,) of the texels beside ``seams``, ascending, and their values (m, 3) float64, with
    which both sides show the same.

    ``pixels`` (n, 3) are all texels' colors without the fit; those that are ``free`` (n,) bool may
    get others.
    """
    chosen = np.zeros(len(pixels), bool)
    for side in (seams.one, seams.other):
        chosen[side.texel[side.weight > SEEN]] = True
    chosen = np.flatnonzero(chosen & free)
    guess = pixels[chosen].astype(float)
    if not len(chosen):
        return chosen, guess
    unknown, light = _Numbers(chosen, len(pixels)), _Numbers(known.texel, len(pixels))
    colored = free.copy()
    colored[known.texel] = True
    rows = _Rows(unknown, colored, pixels)
    touched = (unknown.of(known.middle.texel) >= 0).any(1)
    counts = _Importance(light, known)
    rows.add(known.middle.take(touched), known.share[touched] * counts.known[touched], known.mean[touched])
    both = _difference(seams.one, seams.other)
    seen = counts.at(both)
    rows.add(both, EQUAL * seams.weight * seen)
    alone = Stencils(chosen[:, None], np.ones((len(chosen), 1)))
    stay, margin = STAY * counts.at(alone), light.of(chosen) < 0
    bright = seen[:, None] * _light_seen(both, light, known.mean, pixels)
    around = _of_seams(unknown, both, np.column_stack([seen, bright]))[margin]
    stay[margin], guess[margin] = STAY_MARGIN * around[:, 0], around[:, 1:] / around[:, :1]
    rows.add(alone, stay, guess)
    matrix, right = rows.normal_equations()
    low, high = _bounds(sheets, light, known.mean, chosen, guess)
    low, high = _widened(low, high, unknown, seams)
    values = np.stack(
        [solve_bounded(matrix, *column, TOLERANCE)
         for column in zip(right.T, guess.T, low.T, high.T)], 1
    )  # fmt: skip
    return chosen, values


class _Numbers:
    """Numbers by which each of ``count`` texels is found among ``texel`` (k,)."""

    def __init__(self, texel: np.ndarray, count: int):
        self._number = np.full(count + 1, -1, np.int32)  # the last is found for no texel, -1
        self._number[texel] = np.arange(len(texel))
        self.count = len(texel)

    def of(self, texel: np.ndarray) -> np.ndarray:
        """int32 of the shape of ``texel``: which of the unknown each is; -1 for others."""
        return self._number[texel]


class _Importance:
    """By what squared errors count: (L̄ / max(L, L̄/4))², as in the report, with L the light at a place and L̄ its
    mean."""

    def __init__(self, light: _Numbers, known: Known):
        share = area_shares(known.share)
        self._light, self._scale = light, scale_of(known.mean, share)[:, 0]
        self._mean = max(mean_over(share, known.mean), 1e-30)

    @property
    def known(self) -> np.ndarray:
        """(k,) where light is known."""
        return (self._mean / self._scale) ** 2

    def at(self, places: Stencils) -> np.ndarray:
        """(n,) at ``places`` (n,), by the brightest light that is known of what they see."""
        number = self._light.of(places.texel)
        there = (number >= 0) & (np.abs(places.weight) > SEEN)
        scale = np.where(there, self._scale[number], 0).max(1)
        return (self._mean / np.where(scale > 0, scale, self._scale.min())) ** 2


class _Rows:
    """Equations for the texels that are ``unknown``. Of the other texels those that are ``colored`` (n,) bool have
    the values ``pixels`` (n, 3)."""

    def __init__(self, unknown: _Numbers, colored: np.ndarray, pixels: np.ndarray):
        self.unknown, self.colored, self.pixels = unknown, colored, pixels
        self.matrices, self.weights, self.targets = [], [], []

    def add(self, stencils: Stencils, weight: np.ndarray, target: np.ndarray | None = None) -> None:
        """Ask that ``stencils`` (k,) show ``target`` (k, 3), None: 0, by ``weight`` (k,); those that see a texel without
        a color are left out."""
        at = self.unknown.of(stencils.texel)
        seen = np.abs(stencils.weight) > SEEN
        good = (~seen | self.colored[stencils.texel]).all(1) & (seen & (at >= 0)).any(1)
        texel, at, share = stencils.texel[good], at[good], stencils.weight[good] * seen[good]
        given = share * (at < 0)
        rest = np.zeros((len(at), 3)) if target is None else target[good]
        some = np.flatnonzero(given.any(1))
        rest[some] -= np.einsum("ij,ijc->ic", given[some], self.pixels[texel[some]])
        self.targets.append(rest)
        self.weights.append(weight[good])
        rows, each = at.shape
        entries = (share * (at >= 0)).ravel(), np.maximum(at, 0).ravel()
        start = np.arange(0, rows * each + 1, each)
        self.matrices.append(csr_matrix((*entries, start), shape=(rows, self.unknown.count)))

    def normal_equations(self) -> tuple[csr_matrix, np.ndarray]:
        """Symmetric (m, m) matrix and right sides (m, 3)."""
        rows, weight = vstack(self.matrices, "csr"), np.concatenate(self.weights)
        rows.sum_duplicates()
        rows.eliminate_zeros()
        weighted = rows.T @ diags(weight)
        return (weighted @ rows).tocsr(), weighted @ np.concatenate(self.targets)


def _of_seams(unknown: _Numbers, seams: Stencils, values: np.ndarray) -> np.ndarray:
    """(m, c) mean of ``values`` (k, c) of the ``seams`` (k,) that see each unknown texel, by how much they see of it."""
    number = unknown.of(seams.texel)
    row, column = np.nonzero((number >= 0) & (np.abs(seams.weight) > SEEN))
    number, share = number[row, column], np.abs(seams.weight[row, column])
    total = np.maximum(np.bincount(number, share, unknown.count), 1e-300)
    return np.stack([np.bincount(number, share * v[row], unknown.count) / total for v in values.T], 1)


def _light_seen(seams: Stencils, light: _Numbers, mean: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """(k, 3) mean of the light that is known of what each of ``seams`` (k,) sees; of the ``pixels`` (n, 3) where none
    is."""
    number = light.of(seams.texel)
    known = number >= 0
    share = np.abs(seams.weight) * (known | ~known.any(1, keepdims=True))
    values = np.where(known[..., None], mean[number], pixels[seams.texel])
    return np.einsum("ij,ijc->ic", share, values) / share.sum(1)[:, None]


def _difference(one: Stencils, other: Stencils) -> Stencils:
    return Stencils(np.concatenate([one.texel, other.texel], 1),
                    np.concatenate([one.weight, -other.weight], 1))  # fmt: skip


def _bounds(
    sheets: Sheets, light: _Numbers, mean: np.ndarray, chosen: np.ndarray, guess: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(m, 3) lowest and highest light nearby, or the guess where there is none."""
    low, high = np.full((len(chosen), 3), np.inf), np.full((len(chosen), 3), -np.inf)
    sheet, row, column = sheets.locate(chosen)
    for dy in range(-NEARBY, NEARBY + 1):
        for dx in range(-NEARBY, NEARBY + 1):
            index = light.of(sheets.texel(sheet, row + dy, column + dx))
            there = np.flatnonzero(index >= 0)
            nearby = mean[index[there]]
            low[there] = np.minimum(low[there], nearby)
            high[there] = np.maximum(high[there], nearby)
    alone = ~np.isfinite(low)
    low[alone] = high[alone] = guess[alone]
    return low, high


def _widened(low: np.ndarray, high: np.ndarray, unknown: _Numbers, seams: SeamSamples):
    """(m, 3) bounds: light to both sides of seams, and a little more."""
    texel = np.concatenate([seams.one.texel, seams.other.texel], 1)
    row, column = np.nonzero(unknown.of(texel) >= 0)
    at = unknown.of(texel[row, column])
    for bound, f, empty in ((low, np.minimum, np.inf), (high, np.maximum, -np.inf)):
        joint = np.full((len(texel), 3), empty)
        f.at(joint, row, bound[at])
        f.at(bound, at, joint[row])
    leeway = LEEWAY * (high - low)
    return np.maximum(low - leeway, 0), high + leeway
