"""The installed extension over its life: its first bake, its second, its removal."""

from __future__ import annotations

import json
import sys
from pathlib import Path

run_blender = sys.modules["window"].run_blender  # loaded by conftest.py

# Bakes Blender's first cube; prints when the solver's process was in each phase.
BAKE = """
import importlib, json, sys, time
import bpy
ui = next(n for n in sys.modules if n.endswith(".radiosity_addon.ui"))
session = importlib.import_module(ui + ".session")
came, start, watch = {}, time.perf_counter(), session.BakeSession._watch
def watched(self):
    watch(self)
    came.setdefault(self.detail, time.perf_counter() - start)
session.BakeSession._watch = watched
session.BakeSession.wait = lambda self, seconds: time.sleep(0.02)
assert bpy.ops.radiosity.bake() == {"FINISHED"}
print("CAME", json.dumps(came))
print("IMPORTED", json.dumps([n for n in ("scipy", "embreex") if n in sys.modules]))
"""


def bake(profile: dict) -> tuple[dict, list]:
    """{phase: seconds from the start}, and which libraries Blender's own process imported."""
    told = run_blender(profile, "--background", "--python-expr", BAKE).splitlines()
    found = [next(row for row in told if row.startswith(word)) for word in ("CAME", "IMPORTED")]
    return tuple(json.loads(row.partition(" ")[2]) for row in found)


def compiled(profile: dict) -> dict[Path, int]:
    """{what Python has compiled: when it was written}."""
    found = Path(profile["BLENDER_USER_RESOURCES"]).rglob("*.pyc")
    return {path: path.stat().st_mtime_ns for path in found}


def test_first_bake_compiles_the_second_does_not_and_removal_leaves_nothing(new_profile):
    before = compiled(new_profile)
    first, imported = bake(new_profile)
    assert imported == []  # SciPy and embreex are the solver's process's alone
    assert "loading SciPy" in first  # while Python compiles, the progress says so
    kept = compiled(new_profile)
    assert any(path.parts[-3] == "sparse" for path in kept.keys() - before.keys())
    later = [bake(new_profile)[0] for _ in range(2)]
    assert compiled(new_profile) == kept  # what is there is used: Python writes anew what it cannot use
    began, *again = [min(t for stage, t in came.items() if stage not in ("", "loading SciPy"))
                     for came in (first, *later)]  # fmt: skip
    print(f"STARTED the solver works after {began:.1f} s, later at best after {min(again):.1f} s")
    run_blender(new_profile, "--command", "extension", "remove", "radiosity")
    folder = Path(new_profile["BLENDER_USER_RESOURCES"])
    left = [path for path in folder.rglob("*") if path.is_file()]
    assert {path.name for path in left} <= {"compat.dat", "userpref.blend"}, left
