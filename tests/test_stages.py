"""The pipeline's stages, one by one. The middle one works where Blender is not installed."""

from __future__ import annotations

import pickle
import subprocess
import sys
import textwrap
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from radiosity_addon.bake.texels import texel_receivers
from radiosity_addon.bake_job import run, without_bare
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.receivers import concatenate
from radiosity_addon.solver.sequence import late_warning
from radiosity_addon.stages.layout import lay_out, slice_receivers
from tests.square import UV, square_job

ROOT = Path(__file__).resolve().parents[1]


def test_image_of_a_sunlit_square():
    image = run(square_job("image")).colors[0]
    assert image.shape == (8, 8, 4) and image.dtype == np.float32
    assert image[..., :3] == pytest.approx(0.5, rel=1e-5)
    assert (image[..., 3] == 1).all()


def test_corners_of_a_sunlit_square():
    job = square_job("vertex")
    assert np.array_equal(run(job).colors[0], run(job).colors[0])
    colors = run(job).colors[0]
    assert colors.shape == (6, 3)
    assert colors == pytest.approx(0.5, rel=1e-5)


def test_points_of_a_sunlit_square():
    assert run(square_job("vertex", domain="point")).colors[0].shape == (4, 3)


def test_darkness_is_warned_of():
    dark = run(square_job("image", strength=0))
    assert any("black" in text for text in dark.warnings)
    assert not dark.colors[0][..., :3].any()
    assert not any("black" in text for text in run(square_job("image")).warnings)
    without_glow = run(square_job("image", passes=("emit",))).warnings
    assert any("glows: the result is black" in text for text in without_glow)
    assert not any("black" in text for text in run(square_job("image", passes=("color",))).warnings)


def told_of_light(**options) -> list[str]:
    return [text for text in run(square_job("image", **options)).warnings if "light" in text]


def test_dim_light_is_warned_of():
    """An irradiance of 0.1 W/m², of which white shows 0.1/π; where only a part of the light is asked for,
    little of it means nothing."""
    (text,) = told_of_light(strength=0.1)
    assert "a white surface would have the value 0.03," in text
    assert told_of_light(strength=0.1, passes=("direct",)) == told_of_light() == []


def test_a_time_limit_that_is_not_kept_is_told():
    """65,536 texels get their first rays in no tenth of a second."""
    assert late_warning(7.4, 5.0) == late_warning(7.4, None) == []
    (text,) = late_warning(22.04, 5.0)
    assert text.startswith("solving took 22.0 s, above the time limit of 5 s")
    warnings = run(square_job("image", resolution=256, time_limit=0.1)).warnings
    assert any("above the time limit of 0.1 s" in text for text in warnings)
    assert not any("time limit" in text for text in run(square_job("image", time_limit=60)).warnings)


def test_job_and_result_survive_pickling():
    job = square_job("vertex")
    result = run(pickle.loads(pickle.dumps(job)))
    again = pickle.loads(pickle.dumps(result))
    assert np.array_equal(again.colors[0], run(job).colors[0])


def test_middle_stage_runs_where_blender_cannot_be_imported(tmp_path):
    (tmp_path / "job").write_bytes(pickle.dumps(square_job("vertex")))
    script = f"""
        import pickle, sys
        sys.modules["bpy"] = None  # an import of it fails now
        from radiosity_addon.bake_job import run
        job = pickle.load(open({str(tmp_path / "job")!r}, "rb"))
        print(run(job).colors[0].max())
    """
    text = subprocess.check_output([sys.executable, "-c", textwrap.dedent(script)], cwd=ROOT)
    assert float(text) == pytest.approx(0.5, rel=1e-5)


def test_progress_rises_to_one_and_may_stop_the_work():
    seen = []
    run(square_job("vertex"), lambda phase, fraction: seen.append((phase, fraction)))
    assert seen[-1] == ("Write", 1.0)
    assert all(0 <= fraction <= 1 for _, fraction in seen)

    def stop(phase, fraction):
        raise InterruptedError

    with pytest.raises(InterruptedError):
        run(square_job("vertex"), stop)


def test_a_slice_is_numbered_from_zero():
    numbers = np.arange(2, dtype=np.int32)
    first, second = (texel_receivers(UV, numbers, size) for size in (2, 3))
    part = slice_receivers(concatenate([first, second]), first.count, first.count + second.count)
    assert part.count == 9
    for name in ("receiver", "triangle", "corners", "square", "grid"):
        assert np.array_equal(getattr(part, name), getattr(second, name)), name


def overlaps(*objects) -> tuple[str, ...]:
    """What is told of ``objects``, (name, modifiers, size) each, of which both triangles are laid on the same half of
    a square [texels] in the image."""
    job = square_job("image")
    targets = [
        replace(job.targets[0], name=name, uv=np.repeat(UV[:1], 2, axis=0) * size / 8, modifiers=modifiers)
        for name, modifiers, size in objects
    ]
    return lay_out(replace(job, targets=tuple(targets)), silent).warnings


def test_overlap_names_its_remedy():
    """Half of a square of 8² texels, without the diagonal's, of which each face has a half: 28."""
    assert overlaps(("Wall", (), 8)) == (
        "'Wall': faces overlap in its UV map on 28 texels, which get their mean; bake to a map without overlaps",
    )
    assert overlaps(("Wall", ("Bevel", "Array"), 8)) == (
        "'Wall': faces overlap in its UV map on 28 texels, which get their mean; its modifiers (Bevel, Array) make faces "
        "that share the UVs of others: apply the modifiers, then unwrap or bake again",
    )


def test_overlaps_of_several_objects_are_told_at_once():
    """Halves of squares of 8², 6² and 4² texels: 28, 15 and 6."""
    assert overlaps(("Wall", (), 6), ("Floor", (), 8)) == (
        "'Floor', 'Wall': faces overlap in their UV maps on 43 texels, which get their mean; bake to a map without "
        "overlaps",
    )
    plain, made = overlaps(
        ("Wall", (), 8), ("A", ("Bevel",), 4), ("B", ("Bevel", "Array"), 6), ("C", ("Mirror",), 8), ("D", ("Bevel",), 4)
    )
    assert plain.startswith("'Wall': faces overlap in its UV map on 28 texels")
    assert made == (
        "'C', 'B', 'A' and 1 more: faces overlap in their UV maps on 55 texels, which get their mean; their modifiers "
        "(Mirror, Bevel, Array) make faces that share the UVs of others: apply the modifiers, then unwrap or bake again"
    )
    every = overlaps(*((name, (), 4) for name in "ABCDE"))
    assert every == (
        "'A', 'B', 'C' and 2 more: faces overlap in their UV maps on 30 texels, which get their mean; bake to a map "
        "without overlaps",
    )


def test_a_map_outside_the_tile_is_told_as_the_reason():
    """All UVs on another tile: no texel, and not "no face with an area"."""
    job = square_job("image")
    away = replace(job, targets=(replace(job.targets[0], uv=UV + [2, 0]),))
    with pytest.raises(ValueError, match=r"no texel to bake: 'Square': 100 % .* outside the tile"):
        run(away)


def test_a_map_half_outside_warns_with_the_share():
    """u from ½ to 1½: half of the square's surface."""
    job = square_job("image")
    half = replace(job, targets=(replace(job.targets[0], uv=UV + [0.5, 0]),))
    assert any("50 % of its surface has UVs outside" in text for text in run(half).warnings)


def test_an_object_without_a_texel_is_not_baked():
    """Its image goes with it, the others keep theirs, and the warning has the share."""
    job = square_job("image")
    away = replace(job.targets[0], name="Away", uv=UV + [2, 0])
    pair = replace(job, targets=(away, *job.targets))
    result = run(pair)
    left, less = without_bare(pair, result)
    assert [target.name for target in left.targets] == ["Square"]
    ((name, reason),) = left.skipped
    assert name == "Away" and reason.startswith("its UV map covers no texel: its UVs lie outside")
    assert len(less.colors) == 1 and less.colors[0] is result.colors[1]
    assert sum("'Away': 100 % of its surface" in text for text in less.warnings) == 1
