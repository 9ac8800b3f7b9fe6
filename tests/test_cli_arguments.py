"""The words of the command line, without Blender."""

from __future__ import annotations

import pytest

from radiosity_addon.arguments import parse
from radiosity_addon.settings import Settings


def usage_error(argv, capsys, opened=False) -> str:
    """Status 2 and exactly one line on stderr; returns the line."""
    with pytest.raises(SystemExit) as stop:
        parse(argv, opened)
    assert stop.value.code == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    return lines[0]


def test_defaults_are_those_of_settings():
    request = parse(["room.blend"])
    assert request.settings == Settings()
    assert (request.scene, request.demo, request.output, request.report) == (
        "room.blend", None, None, None,
    )  # fmt: skip


def test_every_option_reaches_the_settings():
    words = (
        "room.blend --output out.blend --report r.json --objects Floor Wall --objects Roof "
        "--target image --domain point --resolution 256 --uv-map Light --margin 3 --image-dir d "
        "--format png --name Lit --passes indirect,direct --quality draft --error 0.02 "
        "--time-limit 5 --no-shading-normals --no-glossy-bounces --seed 7 --threads 2"
    )
    request = parse(words.split())
    assert (request.output, request.report) == ("out.blend", "r.json")
    assert request.settings == Settings(
        objects=("Floor", "Wall", "Roof"),
        target="image",
        domain="point",
        resolution=256,
        uv_map="Light",
        margin=3,
        image_dir="d",
        format="png",
        name="Lit",
        passes=("direct", "indirect"),
        quality="draft",
        error=0.02,
        time_limit=5.0,
        shading_normals=False,
        glossy_bounces=False,
        seed=7,
        threads=2,
    )


def test_error_overrides_quality():
    assert parse("a.blend --quality high".split()).settings.target_error == 0.01
    assert parse("a.blend --quality high --error 0.2".split()).settings.target_error == 0.2


def test_objects_named_twice_are_baked_once():
    assert parse("a.blend --objects A B A".split()).settings.objects == ("A", "B")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("", "--demo cornell"),
        ("a.blend --demo cornell", "choose one"),
        ("--demo sphere", "cornell"),
        ("a.blend --output result.png", ".blend"),
        ("a.blend --report a.blend", "JSON"),
        ("a.blend --image-dir d", "--target image"),
        ("a.blend --target image --format exr", "--image-dir"),
        ("a.blend --target texture", "vertex"),
        ("a.blend --domain face", "corner"),
        ("a.blend --resolution many", "many"),
        ("a.blend --passes direct,glossy", "emit,direct,indirect,color"),
        ("a.blend --passes ,", "emit,direct,indirect,color"),
        ("a.blend --quality best", "draft"),
        ("a.blend --bogus", "--bogus"),
        ("a.blend --time-limit 0", "--time-limit is 0.0; it must lie between 0.1 and 1,000,000 "),
        ("a.blend --density 1 --target image", "--density and --atlas-images are of an atlas"),
        ("a.blend --error 5", "--error is 5.0; it must lie between"),
        ("a.blend --error 3%", "'3%'; give a number"),
        ("a.blend --seed 1.5", "'1.5'; give a whole number"),
        ("a.blend --density 1", "--density is for images"),
        ("a.blend --atlas A", "--atlas is for images"),
        ("a.blend --target image --color-type float", "--color-type is for vertex colors"),
        ("a.blend --target image --uv-map M --unwrap smart", "--unwrap is for a UV map that is made"),
        ("a.blend --target image --uv-map M --atlas A --density 2", "leave them out, or the --uv-map"),
        ("a.blend --scale 2", "--scale is for --color-type byte"),
        ("a.blend --target image --image-dir d --format exr --scale 2", "--scale is for"),
        (f"a.blend --name {'x' * 64}", "more than 63 bytes"),
        ("a.blend --objects", "--objects"),
    ],
)
def test_wrong_usage_is_one_line_and_status_2(words, told, capsys):
    assert told in usage_error(words.split(), capsys)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("--resolution 1024", ["--resolution is for images"]),  # the default, but asked for
        ("--margin 8 --uv-map M", ["--uv-map is for images", "--margin is for images"]),
        ("--unwrap smart --domain point", ["--unwrap is for images"]),
        ("--target image --domain corner", ["--domain is for vertex colors"]),
        ("--target image --resolution 64 --margin 2 --unwrap lightmap", []),
        ("", []),
    ],
)
def test_options_of_the_other_target_are_told(words, told):
    warnings = parse(["a.blend", *words.split()]).warnings
    assert [text.partition(" and changes nothing")[0] for text in warnings] == told


def test_an_open_file_needs_no_name():
    assert parse([], opened=True).scene is None


@pytest.mark.parametrize("word", ["--help", "--version"])
def test_help_and_version_end_with_status_0(word, capsys):
    with pytest.raises(SystemExit) as stop:
        parse([word])
    assert stop.value.code == 0
    assert "radiosity" in capsys.readouterr().out


def test_help_names_every_option(capsys):
    with pytest.raises(SystemExit):
        parse(["--help"])
    text = capsys.readouterr().out
    for option in (
        "output objects target domain resolution uv-map margin image-dir format name passes "
        "quality error seed threads report demo time-limit no-shading-normals no-glossy-bounces"
    ).split():
        assert f"--{option}" in text
