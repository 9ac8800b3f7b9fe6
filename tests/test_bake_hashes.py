"""The tool that shows that a change leaves every bit of the bakes as it was."""

from __future__ import annotations

import json

import pytest

from tools import bake_hashes

QUICK = (
    "image sun", "image two sides", "image instances", "image direct", "image indirect and color",
)  # fmt: skip


def alike_on_two_threads(names):
    """Each bake has the same hash on one thread and on two, and another than all other bakes."""
    one, two = ({name: bake_hashes.hashes(name, n) for name in names} for n in (1, 2))
    assert list(bake_hashes.differing(one, two)) == []
    every = [word for words in one.values() for word in words]
    assert len(set(every)) == len(every)


def test_bakes_are_the_same_on_one_thread_and_two(blender):
    alike_on_two_threads(QUICK)


@pytest.mark.slow
def test_all_other_bakes_are_the_same_on_one_thread_and_two(blender):
    alike_on_two_threads(sorted(bake_hashes.BAKES.keys() - set(QUICK)))


def test_a_hash_tells_of_one_bit(blender, tmp_path, monkeypatch, capsys):
    """One color that differs in its last bit is another hash, and is told by its bake's name."""
    bakes = {"image direct": bake_hashes.BAKES["image direct"]}
    monkeypatch.setattr(bake_hashes, "BAKES", bakes)
    before, after = tmp_path / "before.json", tmp_path / "after.json"
    assert bake_hashes.main([str(before)]) == 0
    assert bake_hashes.main([str(after), "--compare", str(before)]) == 0
    run = bake_hashes.bake_job.run

    def other(*args, **options):
        result = run(*args, **options)
        bits = result.colors[0].reshape(-1).view("uint32")
        bits[bits.argmax()] ^= 1
        return result

    monkeypatch.setattr(bake_hashes.bake_job, "run", other)
    assert bake_hashes.main([str(after), "--compare", str(before)]) == 1
    assert "not the same: image direct" in capsys.readouterr().out
    assert json.loads(before.read_text()).keys() == bakes.keys()
