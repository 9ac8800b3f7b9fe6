"""Options: the command line's, their help and how their values are read."""

from __future__ import annotations

import argparse

from .settings import (
    COLOR_TYPES,
    DOMAINS,
    FORMATS,
    PASSES,
    QUALITY_ERROR,
    TARGETS,
    UNWRAPS,
    Settings,
)

DEMO_NAMES = ("cornell",)
DEFAULTS = Settings()


def build_parser() -> argparse.ArgumentParser:
    """The parser whose ``--help`` is the reference of every option and its default."""
    parser = _Parser(
        prog="radiosity",
        description="Solve diffuse global illumination by radiosity and bake it onto the "
        "objects of a Blender file, as vertex colors or as image textures.",
        epilog="Exit status: 0 done, 1 failed, 2 wrong usage, 130 interrupted.",
    )
    parser.add_argument("--version", action="version", version=_version())
    parser.add_argument("scene", nargs="*", metavar="SCENE.blend", help="the files to bake, each "
                        "into a SCENE_baked.blend")  # fmt: skip
    parser.add_argument(
        "--demo", choices=DEMO_NAMES, help="build a demo scene instead of reading a file"
    )
    parser.add_argument(
        "--output",
        metavar="FILE.blend",
        help="save the result there (SCENE_baked.blend); the input is never written unless named",
    )
    parser.add_argument(
        "--export",
        metavar="FILE.glb",
        help="also write the scene as glTF: the bake in COLOR_0, or as MOZ_lightmap on a second UV",
    )
    parser.add_argument("--report", metavar="FILE.json", help="write the report as JSON")
    destination = parser.add_argument_group("where the colors go")
    _add_targets(destination)
    _add_uv_maps(destination)
    _add_colors(destination)
    _add_accuracy(parser.add_argument_group("accuracy and cost"))
    return parser


def _add_targets(group) -> None:
    add = group.add_argument
    add(
        "--objects",
        nargs="+",
        action="extend",
        metavar="NAME",
        default=[],
        help="objects to bake (all renderable meshes), patterns such as 'Wall*' among them; the "
        "others still light and shadow",
    )
    add("--single-user", action="store_true",
        help="give each object that shares its mesh a copy, and so colors of its own")  # fmt: skip
    add("--target", choices=TARGETS, default=DEFAULTS.target, help="(%(default)s)")
    add("--domain", choices=DOMAINS, help=f"vertex target ({DEFAULTS.domain})")
    add(
        "--resolution",
        type=_size,
        metavar="N|WxH",
        help=f"image target: texels along an edge, or width x height ({DEFAULTS.resolution})",
    )


def _add_uv_maps(group) -> None:
    add = group.add_argument
    add("--atlas", metavar="NAME", help="image target: all objects share the image NAME_<atlas>")
    add(
        "--atlas-images",
        type=_integer,
        metavar="N",
        default=DEFAULTS.atlas_images,
        help="at most so many images for the atlas (%(default)s)",
    )
    add(
        "--density",
        type=_number,
        metavar="D",
        help="texels per meter in the atlas (as many as fit); --resolution is the most then",
    )
    add(
        "--unwrap",
        choices=UNWRAPS,
        help="charts of UV maps that are made: Smart UV Project, Lightmap Pack, or those of the "
        f"map that renders, laid out anew ({DEFAULTS.unwrap})",
    )
    add(
        "--uv-map",
        metavar="NAME",
        help="image target: the UV map to bake to (Radiosity, made where missing)",
    )
    add(
        "--margin",
        type=_integer,
        metavar="N",
        help=f"texels by which islands are extended ({DEFAULTS.margin})",
    )


def _add_colors(group) -> None:
    add = group.add_argument
    add("--image-dir", metavar="DIR", help="also write the images as files into this folder")
    add("--format", choices=FORMATS, help="of the files in --image-dir (exr)")
    add(
        "--color-type",
        choices=COLOR_TYPES,
        help=f"vertex target: 32-bit floats, or 8 bits a channel ({DEFAULTS.color_type})",
    )
    add(
        "--scale",
        type=_scale,
        metavar="S",
        help="divide what is encoded in 8 or 16 bits by S; auto: by the brightest value (1)",
    )
    add(
        "--name",
        default=DEFAULTS.name,
        help="the color attribute NAME, the images NAME_<object> (%(default)s)",
    )
    add(
        "--passes",
        type=_passes,
        metavar=",".join(PASSES),
        default=DEFAULTS.passes,
        help="which parts of the light, in Cycles' meaning of the words (all four)",
    )


def _add_accuracy(group) -> None:
    add = group.add_argument
    presets = ", ".join(f"{name} {error:g}" for name, error in QUALITY_ERROR.items())
    add(
        "--quality",
        choices=tuple(QUALITY_ERROR),
        default=DEFAULTS.quality,
        help=f"target relative error: {presets} (%(default)s)",
    )
    add("--error", type=_number, metavar="E", help="target relative error; overrides --quality")
    add("--time-limit", type=_number, metavar="S", help="the best result within S seconds of solving")
    add(
        "--no-shading-normals",
        dest="shading_normals",
        action="store_false",
        help="light faces as they lie, not as smooth shading, normal and bump maps show them",
    )
    add(
        "--no-glossy-bounces",
        dest="glossy_bounces",
        action="store_false",
        help="leave out what metals, gloss and coatings mirror; else it goes on as from matte surfaces",
    )
    add("--seed", type=_integer, metavar="N", default=DEFAULTS.seed, help="(%(default)s)")
    add("--threads", type=_integer, metavar="N", default=DEFAULTS.threads, help="0: all cores")


class _Parser(argparse.ArgumentParser):
    def error(self, message: str):
        """Wrong usage is one line, not the whole synopsis."""
        self.exit(2, f"{self.prog}: {message} (--help lists the options)\n")


def _passes(text: str) -> tuple[str, ...]:
    """``emit,direct`` → those passes in their canonical order; raises for unknown words."""
    words = [word.strip() for word in text.split(",") if word.strip()]
    unknown = [word for word in words if word not in PASSES]
    if unknown or not words:
        raise argparse.ArgumentTypeError(f"{text!r}; choose from {','.join(PASSES)}")
    return tuple(word for word in PASSES if word in words)


def _size(text: str) -> tuple[int, int | None]:
    """``1024`` or ``2048x1024``: width, and height where it is named."""
    try:
        width, *height = (int(word) for word in text.lower().split("x"))
        (height,) = height or [None]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}; give texels, as 1024 or 2048x1024") from None
    return width, height


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}; give a number, such as 0.5") from None


def _integer(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}; give a whole number") from None


def _scale(text: str) -> float:
    """A positive number, or ``auto``, which is 0."""
    if text == "auto":
        return 0.0
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not value > 0:
        raise argparse.ArgumentTypeError(f"{text!r}; give a number above 0, or auto")
    return value


def _version() -> str:
    from . import __version__

    return f"radiosity {__version__}"
