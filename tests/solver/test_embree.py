"""Tracer: nothing that Embree would read wrongly gets through, nothing that it says is lost."""

import logging
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from embreex import rtcore

from radiosity_addon.solver.tracing import embree
from radiosity_addon.solver.tracing.embree import Tracer

CORNERS = np.array([[0, 0, 0], [0.5, 0, 0], [0, 0.5, 0]])
TRIANGLE = np.array([[0, 1, 2]])
DOWN = np.array([[0, 0, -1]], np.float32)
ABOVE = np.array([[0.1, 0.1, 0.5]], np.float32)


def test_first_hit():
    """From 0.5 above (0.1, 0.1) straight down on a triangle with legs of 0.5: u = v = 0.2."""
    hits = Tracer(CORNERS, TRIANGLE).intersect(ABOVE, DOWN)
    assert hits.triangle == [0] and hits.front == [True]
    np.testing.assert_allclose([hits.u, hits.v, hits.distance], [[0.2], [0.2], [0.5]], rtol=1e-6)


def test_misses_have_no_place():
    """Embree leaves what the ray before met where a ray meets nothing: u = v = 0.2, and a front."""
    beside = np.array([[2, 2, 0.5]], np.float32)
    rays = np.concatenate([ABOVE, beside]), np.concatenate([DOWN, DOWN])
    for chosen in (None, np.array([0])):
        hits = Tracer(CORNERS, TRIANGLE, chosen).intersect(*rays)
        assert hits.triangle.tolist() == [0, -1] and hits.front.tolist() == [True, False]
        assert hits.u[1] == 0 and hits.v[1] == 0


@pytest.mark.parametrize(
    "vertices, triangles, message",
    [
        (CORNERS.ravel(), TRIANGLE, r"vertices have the shape \(9,\)"),
        (CORNERS[:, :2], TRIANGLE, r"vertices have the shape \(3, 2\)"),
        (CORNERS * np.nan, TRIANGLE, "vertices must be finite"),
        (CORNERS * 3, TRIANGLE, r"within \[-1, 1\]"),
        (CORNERS, TRIANGLE.ravel(), r"triangles are int64 \(3,\)"),
        (CORNERS, TRIANGLE * 1.0, r"triangles are float64 \(1, 3\)"),
        (CORNERS, TRIANGLE + 1, "do not exist"),
        (CORNERS, TRIANGLE - 1, "do not exist"),
        (CORNERS, TRIANGLE + (1 << 32), "do not exist"),  # 0, 1, 2 when cut to 32 bits
    ],
)
def test_wrong_meshes_are_refused(vertices, triangles, message):
    with pytest.raises(ValueError, match=message):
        Tracer(vertices, triangles)


@pytest.mark.parametrize("which", ["origins", "directions"])
@pytest.mark.parametrize("method", ["intersect", "clear"])
@pytest.mark.parametrize(
    "spoil, message",
    [
        (lambda rays: rays.astype(float), "float64"),
        (lambda rays: rays.ravel(), r"\(6,\)"),
        (lambda rays: rays[:, :2].copy(), r"\(2, 2\)"),
        (lambda rays: np.repeat(rays, 2, axis=0)[::2], "not contiguous"),
        (lambda rays: np.asfortranarray(rays), "not contiguous"),
        (lambda rays: rays[:1], "1 .*but 2|2 .*but 1"),
        (lambda rays: rays * np.float32(np.nan), "not finite"),
        (lambda rays: rays / np.float32(0), "not finite"),
    ],
)
def test_wrong_rays_are_refused(which, method, spoil, message):
    rays = {"origins": np.repeat(ABOVE, 2, axis=0), "directions": np.repeat(DOWN, 2, axis=0)}
    with np.errstate(divide="ignore", invalid="ignore"):
        rays[which] = spoil(rays[which])
    with pytest.raises(ValueError, match=message):
        getattr(Tracer(CORNERS, TRIANGLE), method)(*rays.values())


def test_long_rays_are_numbers():
    """Their squares are not, in float32."""
    assert not Tracer(CORNERS, TRIANGLE).clear(ABOVE, 1e30 * DOWN)[0]


@pytest.mark.parametrize("lengths", [np.nan, np.array([np.nan])])
def test_lengths_that_are_no_numbers_are_refused(lengths):
    with pytest.raises(ValueError, match="lengths are not numbers"):
        Tracer(CORNERS, TRIANGLE).clear(ABOVE, DOWN, lengths)


@pytest.mark.parametrize("lengths", [np.ones(3), np.ones((2, 1))])
def test_lengths_of_another_shape_are_refused(lengths):
    with pytest.raises(ValueError, match="broadcast"):
        Tracer(CORNERS, TRIANGLE).clear(np.repeat(ABOVE, 2, 0), np.repeat(DOWN, 2, 0), lengths)


def test_no_rays_and_no_triangles_are_fine():
    none = np.zeros((0, 3), np.float32)
    assert len(Tracer(CORNERS, TRIANGLE).intersect(none, none).triangle) == 0
    empty = Tracer(CORNERS, TRIANGLE[:0])
    assert empty.intersect(ABOVE, DOWN).triangle == [-1] and empty.clear(ABOVE, DOWN).all()


@pytest.fixture(params=[logging.WARNING, logging.CRITICAL + 1])
def application(request):
    """One that shows warnings, and one that shows nothing."""
    root = logging.getLogger()
    before = root.level
    root.setLevel(request.param)
    yield
    root.setLevel(before)


def test_what_the_device_logs_is_raised(application):
    """As embreex reports its device: an error on its log, while the call returns normally."""
    tracer = Tracer(CORNERS, TRIANGLE)

    class Failing:
        def run(self, *rays, **options):
            rtcore.log.error("ERROR: %s", "out of memory")
            return {"primID": 0, "u": 0, "v": 0, "tfar": 0, "Ng": np.zeros((1, 3))}

    tracer._scene = Failing()
    for method in (tracer.intersect, tracer.clear):
        with pytest.raises(MemoryError, match="Embree failed: ERROR: out of memory"):
            method(ABOVE, DOWN)
    assert not embree._DEVICE.messages  # said once


MANY_SCENES = """
import numpy as np
from radiosity_addon.solver.tracing.embree import Tracer
kept = [Tracer(np.eye(3) / 2, np.array([[0, 1, 2]])) for _ in range(3000)]
print(len(kept))
"""


def test_thousands_of_scenes_are_held():
    """One for each closed mesh, as a market's fruits: with a device each, the process ended by a segmentation
    fault at about the thousandth. In a process of its own, so that it may end."""
    root = Path(embree.__file__).parents[3]
    run = subprocess.run([sys.executable, "-c", MANY_SCENES], cwd=root, capture_output=True, text=True)
    assert (run.returncode, run.stdout) == (0, "3000\n"), run.stderr
