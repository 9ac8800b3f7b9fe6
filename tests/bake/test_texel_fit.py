"""Texels beside borders: what they show where the surface goes on, and where it does not."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.bake.border_samples import sample_seams
from radiosity_addon.bake.continuations import find_seams
from radiosity_addon.bake.islands import Charted, cut_into_islands
from radiosity_addon.bake.shown import Sheets, Stencils
from radiosity_addon.bake.texel_fit import EQUAL, Known, fit_texels
from radiosity_addon.bake.texel_parts import anchored_texels, shows_own, texel_parts
from radiosity_addon.bake.texels import texel_receivers
from radiosity_addon.bake.unfit import UnfitCells, UnfitTexels, crowded_shares

SIZE = 24  # texels of an image's edge
QUAD = np.array([(0, 1, 2), (0, 2, 3)])


def slabs(*slabs, texels=8.0, corner=(3.3, 4.7)):
    """Rectangles ((x, y, z), along, across) with an image each, ``texels`` per unit of length."""
    vertices, uv = [], []
    for origin, along, across in slabs:
        a, b = (np.linalg.norm(side) for side in (along, across))
        square = np.array([(0, 0), (a, 0), (a, b), (0, b)]) * texels + corner
        vertices.append(np.array(origin) + [np.zeros(3), along, np.add(along, across), across])
        uv.append(square[QUAD])
    count = len(slabs)
    triangles = (QUAD + 4 * np.arange(count)[:, None, None]).reshape(-1, 3)
    sheet = np.repeat(np.arange(count), 2)
    flat = np.zeros((2 * count, 3, 3))
    return Charted(np.concatenate(vertices), triangles, np.concatenate(uv), sheet, flat)


def known_light(charted, sheets, light):
    """Means of ``light``, a linear function of (k, 3): its values at the middles of cells."""
    texel, middle, share, mean = [], [], [], []
    for image in range(charted.sheet.max() + 1):
        own = np.flatnonzero(charted.sheet == image)
        receivers = texel_receivers(charted.uv[own] / SIZE, own, SIZE, image)
        parts = texel_parts(receivers, charted.uv, receivers.triangle)
        a, at = parts.of_receivers(receivers)
        triangle = receivers.triangle[np.searchsorted(receivers.receiver, np.arange(receivers.count))]
        corners = np.concatenate([charted.uv, np.ones((len(charted.uv), 3, 1))], 2)[triangle]
        maps = np.linalg.solve(corners, charted.vertices[charted.triangles[triangle]])
        place = np.einsum("ij,ijk->ik", np.c_[at, np.ones(len(at))], maps)
        texel.append(sheets.texel(np.full(len(a), image), *receivers.grid[:, 1:].T.astype(int)))
        middle.append(at)
        share.append(a)
        mean.append(light(place))
    texel, middle = np.concatenate(texel), np.concatenate(middle)
    stencils = sheets.stencils(sheets.locate(texel)[0], middle)
    return Known(texel, stencils, np.concatenate(share), np.concatenate(mean))


def fit(charted, light, with_seams=True):
    """Shown along the seams, before and after: two pairs of (k, 3); and the places (k, 3)."""
    images = charted.sheet.max() + 1
    sheets = Sheets(np.full(images, SIZE), np.full(images, SIZE))
    known = known_light(charted, sheets, light)
    _, edges = cut_into_islands(charted)
    seams = sample_seams(charted, edges, find_seams(charted, edges), sheets)
    nearest = np.abs(
        np.stack(sheets.locate(np.arange(images * SIZE**2)), 1)[:, None]
        - np.stack(sheets.locate(known.texel), 1) * [1, 1, 1]
    )
    nearest[..., 0] *= 100
    pixels = known.mean[nearest.sum(-1).argmin(1)]
    whole = known.texel[known.share > 0.9999]
    used = seams if with_seams else seams.take(np.zeros(len(seams.weight), bool))
    texel, value = fit_texels(sheets, known, used, pixels, ~np.isin(np.arange(len(pixels)), whole))
    after = pixels.copy()
    after[texel] = value
    assert np.array_equal(after[whole], pixels[whole])
    shown = [(seams.one.of(p), seams.other.of(p)) for p in (pixels, after)]
    return *shown, (seams.across.starts + seams.across.ends) / 2


def slope(place):
    return 2 + place[:, :1] * [1.0, 2.0, 0.5] + place[:, 1:2] * [0.3, -0.2, 0.1]


FLOOR = ((0, 0, 0), (1, 0, 0), (0, 1, 0))
BESIDE = ((1, 0, 0), (1, 0, 0), (0, 1, 0))


@pytest.mark.parametrize("corner", [(3.3, 4.7), (3.0, 5.0), (3.5, 4.5), (3.9, 4.1)])
def test_both_sides_of_a_seam_show_linear_light(corner):
    """Eight texels a unit. Bilinear pictures hold linear light exactly, so all equations but those
    that keep texels where they are are met by it. These matter most for a margin texel of weight w
    in the seam: it is up to 1.2 texels' slope away from the texel it was filled from, and pulls the
    seam by s where ε (1.2 − s / w) / w = a s, a from 0.04 (a tenth of a texel covered) to 0.2 for
    the texels that hold it: s is 0.003 of a texel at w = 0.2, a = 0.2, and 0.007 at w = 0.4, a = 0.04,
    with ε = 0.0001. The border lies 0.3, 0, 0.5 or 0.9 of a texel beyond a texel's edge. Without the fit the
    light of the outermost parts is shown there, up to half a texel off: 1/16 of a unit."""
    before, after, place = fit(slabs(FLOOR, BESIDE, corner=corner), slope)
    truth = slope(place)
    off = np.abs(np.concatenate(before) - np.tile(truth, (2, 1))).max()
    assert 0.02 < off < 0.16
    assert np.abs(after[0] - after[1]).max() < 0.01 * off + 1e-3
    inner = (place[:, 1] > 0.2) & (place[:, 1] < 0.8)
    for side in after:
        assert (np.abs(side[inner] - truth[inner]) / np.abs([1.0, 2.0, 0.5]) * 8).max() < 0.05


def test_without_seams_nothing_changes():
    """A texel of which 0.7 is covered keeps its mean where nothing goes on: a corner, or a crease."""
    charted = slabs(FLOOR, BESIDE, corner=(3.7, 4.0))
    before, after, _ = fit(charted, slope, with_seams=False)
    assert np.array_equal(before, after)


def test_light_that_jumps_keeps_most_of_its_jump():
    """Slabs that end in the middles of texels: 1 is known on one, 0 on the other. The outermost texels
    x = 1 − b and d are shown at the seam; half of each is covered, whose middle lies a quarter of a
    texel before: 3/4 x + 1/4 of the next is to be 1 and 0. Light counts against itself, but a quarter of its mean of ½ at
    least: errors of the dark slab 64 times, and the jump as those of the bright one. ½ (3/4 b)² + 64 · ½ (3/4 d)² +
    λ (1 − b − d)² is least where 9/16 b = 2 λ (1 − b − d) and b = 64 d: b = 2 λ / (9/16 + 2 λ (1 + 1/64)), 0.63 for
    λ = 1/2, and d is 0.01: little light is put where there is none."""
    charted = slabs(FLOOR, BESIDE, corner=(3.5, 4.5))
    step = lambda place: np.repeat((place[:, :1] < 1) * 1.0, 3, axis=1)
    before, after, place = fit(charted, step)
    b = 2 * EQUAL / (9 / 16 + 2 * EQUAL * (1 + 1 / 64))
    inner = (place[:, 1] > 0.3) & (place[:, 1] < 0.7)
    assert np.abs(before[0] - before[1])[inner] == pytest.approx(1)
    assert after[0][inner] == pytest.approx(1 - b, abs=0.01)
    assert after[1][inner] == pytest.approx(b / 64, abs=0.001)


def test_margins_between_a_dark_and_a_bright_island_go_with_the_dark_one():
    """Two slabs whose borders with a neighbor lie side by side in one image, 1.5 texels apart, of light 0.01 and 1, as
    their neighbors have it in images of their own. Both see the column of texels between, by weights of 0.2 and 0.3,
    which cannot be right for both. L̄ is about ½: squares count (1 / (L̄/4))² = 64 times on the dark ones. They are least
    where what is off counts alike for both, there by a 64th of what it is on the bright ones: an eighth, judged against
    L̄/4. By the light alone it was as much as on these, and 36 % of L̄/4."""
    dark, bright = ((0, 0, 0), (1, 0, 0), (0, 1, 0)), ((9, 0, 0), (1, 0, 0), (0, 1, 0))
    beside = ((1, 0, 0), (1, 0, 0), (0, 1, 0)), ((8, 0, 0), (1, 0, 0), (0, 1, 0))
    charted = slabs(dark, bright, *beside, corner=(3.7, 4.7))
    charted.sheet[:] = 0, 0, 0, 0, 1, 1, 2, 2
    charted.uv[2:4] += 8 + 1.5, 0
    light = lambda place: np.where(place[:, :1] < 5, 0.01, 1.0) * np.ones(3)
    _, after, place = fit(charted, light)
    off, mine = np.abs(after - light(place)).max((0, 2)), place[:, 0] < 5
    judged = off / np.where(mine, 0.505 / 4, 1)
    assert (judged[~mine] > 0.15).all()
    assert (judged[mine] < 0.25 * judged[~mine].min()).all()


def test_margins_beside_a_bright_island_that_has_no_seam():
    """A slab of light 1 and its neighbor in an image of its own; beside its border, 1.5 texels away, one of light 30, from
    which the column between is filled. Most of the surface is dark, so that both are far above the mean."""
    bright, strip, beside = (((x, 0, 0), (along, 0, 0), (0, 0.25, 0)) for x, along in ((9, 0.25), (0, 1), (-1, 1)))
    charted = slabs(bright, strip, beside, *(((x, 0, 0), (2, 0, 0), (0, 2, 0)) for x in (20, 30, 40)), corner=(3.7, 4.7))
    charted.sheet[:] = np.repeat([0, 0, 1, 2, 3, 4], 2)
    charted.uv[2:4] += 2 + 1.5, 0
    light = lambda place: np.select([place[:, :1] < 5, place[:, :1] < 15], [1.0, 30.0], 0.001) * np.ones(3)
    before, after, _ = fit(charted, light)
    assert np.array(before).max() > 3
    assert np.abs(np.array(after) - 1).max() < 0.01


def test_borders_continue_where_one_ends_in_the_other():
    """A slab beside two of half its length: its border is cut at their common corner."""
    half = [((1, y, 0), (1, 0, 0), (0, 0.5, 0)) for y in (0.0, 0.5)]
    charted = slabs(FLOOR, *half)
    _, edges = cut_into_islands(charted)
    seams = find_seams(charted, edges)
    lengths = np.abs(seams.one.along[:, 1] - seams.one.along[:, 0])
    pairs = {
        tuple(sorted(charted.sheet[edges.triangle[[a, b]]]))
        for a, b in zip(seams.one.edge, seams.other.edge)
    }
    assert pairs == {(0, 1), (0, 2), (1, 2)}
    assert sorted(lengths.round(9)) == pytest.approx([0.5, 0.5, 1.0])
    before, after, _ = fit(charted, slope)
    assert np.abs(before[0] - before[1]).max() > 0.1
    assert np.abs(after[0] - after[1]).max() < 1e-2


@pytest.mark.parametrize(
    "other",
    [
        ((1, 0, 0), (0, 0, 1), (0, 1, 0)),  # a wall
        ((1, 1, 0), (-1, 0, 0), (0, -1, 0)),  # the same place again
        ((1, 1, 0), (1, 0, 0), (0, -1, 0)),  # beside it, but turned down
        ((1, 0, 0.01), (1, 0, 0), (0, 1, 0)),  # a step up
    ],
)
def test_surfaces_do_not_continue_over_creases_and_steps(other):
    charted = slabs(FLOOR, other)
    assert not len(find_seams(charted, cut_into_islands(charted)[1]).one.edge)


def test_faces_bent_by_three_degrees_are_one_surface_and_smooth_ones_by_more():
    for angle, smooth, found in ((2.5, False, 1), (3.5, False, 0), (20, True, 1)):
        turn = np.radians(angle)
        charted = slabs(FLOOR, ((1, 0, 0), (np.cos(turn), 0, np.sin(turn)), (0, 1, 0)))
        if smooth:
            charted.normals[:] = -np.sin(turn / 2), 0, np.cos(turn / 2)
        seams = find_seams(charted, cut_into_islands(charted)[1])
        assert len(seams.one.edge) == found


def test_texels_are_anchored_beside_whole_ones_of_their_island_and_none_of_another():
    """A row of eight texels: 0 partly and 1 wholly of island 0, 2 without a face, 3 partly and 4 wholly of
    island 1, 5 of islands 1 and 2, 6 partly and 7 wholly of island 2. Next to 4 and 6 lies another
    island's, 5 is two's."""
    sheets = Sheets(np.array([8]), np.array([1]))
    texel = np.array([0, 1, 3, 4, 5, 6, 7])
    whole = np.array([0, 1, 0, 1, 0, 0, 1], bool)
    cells, island = np.array([0, 1, 3, 4, 5, 5, 6, 7]), np.array([0, 0, 1, 1, 1, 2, 2, 2])
    found = anchored_texels(sheets, texel, whole, cells, island)
    assert found.tolist() == [True, True, True, False, False, False, True]
    # Without the whole texel beside it nothing holds a partly covered one.
    assert not anchored_texels(sheets, texel, whole & (texel > 1), cells, island)[:2].any()


def unfit_shares(*cells, parts=1):
    """What cannot be fitted of the cells' one target, counted in ``parts`` of texels."""
    cells = UnfitCells(*cells)
    found = UnfitTexels(np.zeros(cells.island.max() + 1, int))
    for part in range(parts):
        found.add(cells.take(cells.texel % parts == part))
    return found.shares(0)


@pytest.mark.parametrize("parts", [1, 2, 3])
def test_texels_of_crowded_and_thin_islands_are_counted(parts):
    """Texel 1 is 0.6 of island 0 and 0.4 of island 1: shared. Island 2 has only half a texel. It is so, too, when texels
    come in parts, of which only one has the whole texel that shows that an island is not thin."""
    texel, island = np.array([0, 1, 1, 2, 3]), np.array([0, 0, 1, 1, 2])
    part = np.array([1, 0.6, 0.4, 1, 0.5])
    count, shared, thin = unfit_shares(texel, island, part, part, np.zeros(5), parts=parts)
    assert (count, shared, thin) == (2, pytest.approx(1 / 3.5), pytest.approx(0.5 / 3.5))


def test_a_place_shows_its_own_island_where_no_texel_is_of_another():
    """A row of six texels: 0 and 1 of island 0, 2 without a face, 3 of island 1, 4 of islands 1 and 2. Seen are two
    each, the second not where its weight is 0."""
    sheets = Sheets(np.array([6]), np.array([1]))
    texel = np.array([(0, 1), (1, 2), (2, 3), (2, 3), (3, 4), (3, 4), (5, 3)])
    weight = np.array([(0.5, 0.5)] * 5 + [(1.0, 0.0)] * 2)
    island = np.array([0, 0, 0, 1, 1, 1, 0])
    cells, owner = np.array([0, 1, 3, 4, 4]), np.array([0, 0, 1, 1, 2])
    found = shows_own(sheets, Stencils(texel, weight), island, cells, owner)
    assert found.tolist() == [True, True, False, True, False, True, True]


def two_islands(gap):
    """Squares of 4 × 4 texels beside each other in one image, far apart in space."""
    charted = slabs(((0, 0, 0), (0.5, 0, 0), (0, 0.5, 0)), ((0, 9, 0), (0.5, 0, 0), (0, 0.5, 0)), corner=(2, 3))
    charted.uv[2:] += 4 + gap, 0
    charted.sheet[:] = 0
    return charted


@pytest.mark.parametrize(("gap", "share"), [(0, 1 / 8), (0.5, 1 / 16), (1, 0)])
def test_texels_mixed_with_those_of_another_island_are_counted(gap, share):
    """Islands of 4 texels' width that touch at a texel's border: half of the outermost texel to both
    sides is mixed with the other island's, 1/8 of each. Half a texel apart that is so of the first, which
    ends with its fourth texel; the second begins in the middle of one, from where on nothing of the first is
    seen. A texel apart nothing is mixed. (Of the texel in the first one's upper right corner, which its
    diagonal divides, the half to the right is counted, and the other not.)"""
    charted = two_islands(gap)
    sheets = Sheets(np.array([SIZE]), np.array([SIZE]))
    receivers = texel_receivers(charted.uv / SIZE, np.arange(4), SIZE)
    parts = texel_parts(receivers, charted.uv, receivers.triangle)
    island = cut_into_islands(charted)[0][receivers.triangle]
    texel = sheets.texel(0, *receivers.grid[:, 1:].T.astype(int))[receivers.receiver]
    crowded = crowded_shares(sheets, parts, texel, island)
    count, close, thin = unfit_shares(texel, island, parts.area, parts.area, crowded)
    assert close == pytest.approx(share) and thin == 0
    assert count == 64 * share


def test_triangles_with_vertices_of_their_own_are_one_island():
    """A mesh from a game, of which every triangle has its own three vertices: one island with four
    borders, as of the same with vertices in common. Moved in the image, or in space, it is two."""
    charted = slabs(FLOOR)
    apart = Charted(charted.vertices[QUAD].reshape(6, 3), np.arange(6).reshape(2, 3), charted.uv,
                    charted.sheet, charted.normals)  # fmt: skip
    for mesh in (charted, apart):
        island, edges = cut_into_islands(mesh)
        assert island.tolist() == [0, 0] and len(edges.triangle) == 4
    apart.uv[1] += 0.1
    assert cut_into_islands(apart)[0].tolist() == [0, 1]
    apart.uv[1] -= 0.1
    apart.vertices[3:] += [0, 0, 1]
    assert cut_into_islands(apart)[0].tolist() == [0, 1]
