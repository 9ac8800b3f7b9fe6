"""Memory: measured, and refused before it is taken."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from radiosity_addon import memory

ROOT = Path(__file__).resolve().parents[1]


def test_peak_counts_bytes():
    """64 MiB touched in a fresh process raise the peak by 64 MiB, give or take 8."""
    script = """
        import numpy as np
        from radiosity_addon.memory import peak_memory
        before = peak_memory()
        block = np.ones(8 << 20)  # 8 Mi numbers of 8 bytes
        print(peak_memory() - before)
    """
    text = subprocess.check_output([sys.executable, "-c", textwrap.dedent(script)], cwd=ROOT)
    assert int(text) == pytest.approx(64 << 20, abs=8 << 20)


def test_what_is_free_is_allowed_and_more_is_refused(monkeypatch):
    monkeypatch.setattr(memory, "available_memory", lambda: 3 << 30)
    memory.require(3 << 30, "an image", "make it smaller")
    with pytest.raises(MemoryError, match="an image needs about 4.0 GB .* 3.0 GB are free; make"):
        memory.require(4 << 30, "an image", "make it smaller")


def test_memory_of_images_grows_with_what_is_kept_only():
    """Above UNDIVIDED texels one tile is worked on: more of them take what is kept of each, and never less
    than fewer do. 4096² bakes in 6 GB, and 500 images of 1024² in 8 GB, with what is ALWAYS taken:
    2,900 · 1.1 · 700,000 + 600 · 400,000 + 8 · 500 · 1024² + 60 · 1024² = 6.7 GB, and 450 MB."""
    whole, texels = memory.UNDIVIDED, 1024**2
    below, above = (memory.of_images(texels, 1000, 0) for texels in (whole, whole + 1))
    assert below == above == memory.PER_RECEIVER * whole
    more = memory.of_images(700 * texels, texels, 0) - memory.of_images(600 * texels, texels, 0)
    assert more == memory.KEPT * 100 * texels
    assert memory.of_images(4096**2, 4096**2, 0) + memory.ALWAYS < 6e9
    many = memory.of_images(500 * texels, texels, 0)
    assert many == pytest.approx(6.73e9, rel=1e-3) and many + memory.ALWAYS < 8e9


def test_what_fits_is_told_and_fits():
    """Images of 1024² up to what 8 GB hold: as many as are told fit, one more does not; and so with the
    edge of one image, in steps of 16."""
    free, texels = 8e9, 1024**2
    share = memory.fitting_share(free, lambda s: memory.of_images(s * 2000 * texels, texels, 0))
    number = int(2000 * share)
    assert memory.of_images(number * texels, texels, 0) <= free
    assert memory.of_images((number + 1) * texels, texels, 0) > free
    edge = memory.fitting_edge(16384, free, 16384**2, 16384**2, 0)
    assert edge % 16 == 0
    assert memory.of_images(edge**2, edge**2, 0) <= free
    assert memory.of_images((edge + 16) ** 2, (edge + 16) ** 2, 0) > free
    assert memory.fitting_edge(64, free, 64**2, 64**2, 0) == 64
    assert memory.fitting_edge(1024, 0.0, texels, texels, 0) == 0


def test_unknown_free_memory_refuses_nothing(monkeypatch):
    monkeypatch.setattr(memory, "available_memory", lambda: None)
    memory.require(1 << 60, "an image", "make it smaller")


@pytest.mark.skipif(sys.platform != "linux", reason="ulimit -v is Linux's")
def test_own_limit_counts():
    """With 2 GB of address space, at most that is available."""
    script = "from radiosity_addon.memory import available_memory; print(available_memory())"
    text = subprocess.check_output(
        ["/bin/sh", "-c", 'ulimit -v 2000000; exec "$0" -c "$1"', sys.executable, script], cwd=ROOT
    )
    assert 0 < int(text) < 2_000_000 * 1024
