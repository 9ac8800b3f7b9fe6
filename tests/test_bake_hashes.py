"""The tool that shows that a change leaves every bit of the bakes as it was."""

from __future__ import annotations

import json

import pytest

from radiosity_addon import bake_job
from tools.bake_hashes import differing, hashes, main
from tools.bake_scenes import BAKES

QUICK = (
    "image sun", "image two sides", "image instances", "image direct", "image indirect and color",
)  # fmt: skip


def alike_on_two_threads(names):
    """Each bake has the same hash on one thread and on two, and another than all other bakes."""
    one, two = ({name: hashes(BAKES[name], n) for name in names} for n in (1, 2))
    assert list(differing(one, two)) == []
    every = [word for words in one.values() for word in words]
    assert len(set(every)) == len(every)


def test_bakes_are_the_same_on_one_thread_and_two(blender):
    alike_on_two_threads(QUICK)


@pytest.mark.slow
def test_all_other_bakes_are_the_same_on_one_thread_and_two(blender):
    alike_on_two_threads(sorted(BAKES.keys() - set(QUICK)))


def test_a_hash_tells_of_one_bit(blender, tmp_path, capsys):
    """One color that differs in its last bit is another hash, and is told by its bake's name."""
    bakes = {"image direct": BAKES["image direct"]}
    before, after = tmp_path / "before.json", tmp_path / "after.json"
    assert main([str(before)], bakes) == 0
    assert main([str(after), "--compare", str(before)], bakes) == 0

    def other(*args, **options):
        result = bake_job.run(*args, **options)
        bits = result.colors[0].reshape(-1).view("uint32")
        bits[bits.argmax()] ^= 1
        return result

    assert main([str(after), "--compare", str(before)], bakes, other) == 1
    assert "not the same: image direct" in capsys.readouterr().out
    assert json.loads(before.read_text()).keys() == bakes.keys()
