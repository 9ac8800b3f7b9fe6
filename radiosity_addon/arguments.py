"""Arguments: the command line's words checked, as a BakeRequest."""

from __future__ import annotations

import argparse
import re
from dataclasses import dataclass, fields, replace

from .options import build_parser
from .settings import Settings, Target
from .solver.expected import Refused

DEFAULTS = Settings()
SCALED = ("png", "png16", "rgbm")  # formats with a scale
# Options that one target alone has a use for, and what that is for.
ONLY_FOR = {
    Target.IMAGE: ("resolution", "unwrap", "uv_map", "margin"),
    Target.VERTEX: ("domain",),
}
TARGET_NAMES = {Target.IMAGE: "images", Target.VERTEX: "vertex colors"}


@dataclass(frozen=True)
class BakeRequest:
    """What one run is to do. Paths are as the user wrote them; None where not given."""

    settings: Settings
    scene: str | None  # the .blend to read; None: the demo, or the file that is open
    demo: str | None
    output: str | None
    report: str | None
    export: str | None = None  # a .glb with the bake in it
    more: tuple[str, ...] = ()  # further files to bake, each like the first
    single_user: bool = False  # meshes that several objects share are copied first
    label: str = ""  # the file, where it is one of several
    warnings: tuple[str, ...] = ()  # of options that change nothing

    def each(self) -> list[BakeRequest]:
        """One request for each file."""
        one = replace(self, more=())
        if not self.more:
            return [one]
        return [replace(one, scene=path, label=path) for path in (self.scene, *self.more)]


def parse(argv: list[str], opened: bool = False) -> BakeRequest:
    """Read the options; ``opened``: a file is open already, so none need be named.

    Raises SystemExit with status 2 after one line on stderr for wrong usage, and with status 0
    after ``--help`` and ``--version``.
    """
    parser = build_parser()
    found = parser.parse_intermixed_args(argv)
    if found.scene and found.demo:
        parser.error("SCENE.blend and --demo are both given; choose one")
    if not (found.scene or found.demo or opened):
        parser.error("nothing to bake; name a SCENE.blend or give --demo cornell")
    if found.output and not found.output.lower().endswith(".blend"):
        parser.error(f"--output is {found.output!r}; its name must end in .blend")
    if found.report and found.report.lower().endswith(".blend"):
        parser.error(f"--report is {found.report!r}; it is JSON, and no .blend may be lost to it")
    if found.export and not found.export.lower().endswith(".glb"):
        parser.error(f"--export is {found.export!r}; its name must end in .glb")
    if found.image_dir and found.target != Target.IMAGE:
        parser.error("--image-dir writes images; add --target image")
    if found.format and not found.image_dir:
        parser.error("--format is for image files; say where with --image-dir DIR")
    if found.color_type and found.target != Target.VERTEX:
        parser.error("--color-type is for vertex colors; images have --format")
    if found.scale is not None and not (found.color_type == "byte" or found.format in SCALED):
        parser.error(f"--scale is for --color-type byte and --format {', '.join(SCALED)}")
    if found.unwrap and found.uv_map:
        parser.error(f"--unwrap is for a UV map that is made, and --uv-map {found.uv_map!r} is used as "
                     "it is; leave one of them out")  # fmt: skip
    for option in ("atlas", "density"):
        if getattr(found, option) is not None and found.target != Target.IMAGE:
            parser.error(f"--{option} is for images; add --target image")
    if len(found.scene) > 1:
        _check_several(parser, found)
    settings = _settings(found)
    try:
        settings.check()
    except Refused as error:
        parser.error(_with_options(str(error)))
    first, *more = found.scene or [None]
    return BakeRequest(
        settings, first, found.demo, found.output, found.report, found.export, tuple(more),
        found.single_user, warnings=_unused(found),
    )


def _check_several(parser, found) -> None:
    """Refuse files that one bake would write over another's, and a file that is named twice."""
    for option in ("output", "report", "image_dir", "export"):
        if getattr(found, option):
            parser.error(f"--{option.replace('_', '-')} is for one file and {len(found.scene)} are "
                         "named; leave it out or call once for each")  # fmt: skip
    if len(set(found.scene)) < len(found.scene):
        parser.error("a SCENE.blend is named twice; name each once")


def _with_options(text: str) -> str:
    """The text with the names of settings replaced by those of options. Names of several words are replaced
    everywhere, others (``error``) only where a verb follows, as they are words of plain English, too."""
    words = {each.name: f"--{each.name.replace('_', '-')}" for each in fields(Settings)}
    several = rf"\b({'|'.join(name for name in words if '_' in name)})\b"
    each = rf"\b({'|'.join(name for name in words if name != 'height')})\b(?=[^'\"]*? (is|are|has)\b)"
    for pattern in (several, each):
        text = re.sub(rf"(?<!-){pattern}", lambda found: words[found[1]], text)
    return text


def _unused(found) -> tuple[str, ...]:
    """A warning for each option that was given and changes nothing."""
    return tuple(
        f"--{option.replace('_', '-')} is for {TARGET_NAMES[target]} and changes nothing here; add "
        f"--target {target}"
        for target, options in ONLY_FOR.items() if found.target != target
        for option in options if getattr(found, option) is not None
    )  # fmt: skip


def _settings(found: argparse.Namespace) -> Settings:
    """The Settings that the options stand for; those not given have their defaults."""
    given = {name: getattr(found, name) for name in ("domain", "unwrap", "margin", "color_type")}
    width, height = found.resolution or (DEFAULTS.resolution, None)
    return Settings(
        **{name: value for name, value in given.items() if value is not None},
        objects=tuple(dict.fromkeys(found.objects)),
        target=found.target,
        resolution=width,
        height=height,
        atlas=found.atlas,
        atlas_images=found.atlas_images,
        density=found.density,
        uv_map=found.uv_map,
        image_dir=found.image_dir,
        format=found.format,
        scale=found.scale,
        name=found.name,
        passes=found.passes,
        quality=found.quality,
        error=found.error,
        shading_normals=found.shading_normals,
        glossy_bounces=found.glossy_bounces,
        time_limit=found.time_limit,
        seed=found.seed,
        threads=found.threads,
    )
