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
