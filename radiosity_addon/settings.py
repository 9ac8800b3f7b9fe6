"""Settings: the one source of every default."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, get_args

from .solver.expected import Refused
from .solver.passes import Pass


class Target(StrEnum):
    """Where colors go; equal to its word in settings."""

    VERTEX = "vertex"
    IMAGE = "image"


class Domain(StrEnum):
    """What a color attribute has a value for each of; equal to its word in settings."""

    CORNER = "corner"  # of a face
    POINT = "point"  # a vertex


QUALITY_ERROR = {"draft": 0.1, "medium": 0.03, "high": 0.01}
PASSES = tuple(each.value for each in Pass)
TARGETS = tuple(each.value for each in Target)
DOMAINS = tuple(each.value for each in Domain)
Format = Literal["exr", "png", "png16", "hdr", "rgbm", "rgbe"]
ColorType = Literal["float", "byte"]
Unwrap = Literal["smart", "lightmap", "existing"]
FORMATS, COLOR_TYPES, UNWRAPS = (get_args(words) for words in (Format, ColorType, Unwrap))
LONGEST_NAME = 63  # length [bytes] of an attribute's name: Blender cuts longer ones
RESOLUTION_RANGE = (4, 16384)  # edges [texels] of an image
ERROR_RANGE = (1e-4, 1.0)  # errors [relative] that may be asked for
DENSITY_RANGE = (1e-3, 1e5)  # densities [texels per meter]
ATLAS_IMAGES_RANGE = (1, 64)  # numbers [images of an atlas]


@dataclass(frozen=True)
class Settings:
    """What the user asks of a bake. The command line and the panel only fill this in."""

    objects: tuple[str, ...] = ()  # names of receivers; empty: every renderable mesh
    target: str = Target.VERTEX.value
    domain: str = Domain.CORNER.value
    resolution: int = 1024  # texels along an image's lower edge
    height: int | None = None  # texels along its other edge; None: as many
    atlas: str | None = None  # name of what all objects share; None: an image for each
    atlas_images: int = 1  # at most so many images for the atlas
    density: float | None = None  # texels per meter in the atlas; None: as many as fit
    unwrap: Unwrap = "smart"  # how a missing UV map is made
    uv_map: str | None = None  # None: the map "Radiosity", made where missing
    margin: int = 8  # texels
    image_dir: str | None = None
    format: Format | None = None  # of the files in image_dir; None: exr when image_dir is given
    color_type: ColorType = "float"  # of the color attribute: 32-bit float, or 8 bits a channel
    scale: float | None = None  # divides encoded values; 0: the brightest; None: 1, RGBM: 0
    name: str = "Radiosity"
    passes: tuple[Pass | str, ...] = PASSES
    quality: str = "medium"
    error: float | None = None  # target relative error; None: that of the quality
    shading_normals: bool = True  # light counts as faces are shaded; False: as they lie
    glossy_bounces: bool = True  # what surfaces mirror goes on as if matte; False: it is left out
    time_limit: float | None = None  # seconds of solving; None: no limit
    seed: int = 0
    threads: int = 0  # 0: all cores

    @property
    def target_error(self) -> float:
        """The relative error asked for, local and over the surface (docs/theory.md)."""
        return QUALITY_ERROR[self.quality] if self.error is None else self.error

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of an image [texels]."""
        return self.resolution, self.height or self.resolution

    def check(self) -> None:
        """Raise Refused naming the first setting out of range, its value, limit and remedy."""
        for name, value, allowed in (
            ("target", self.target, TARGETS),
            ("domain", self.domain, DOMAINS),
            ("quality", self.quality, tuple(QUALITY_ERROR)),
            ("format", self.format or "exr", FORMATS),
            ("color_type", self.color_type, COLOR_TYPES),
            ("unwrap", self.unwrap, UNWRAPS),
        ):
            if value not in allowed:
                raise Refused(f"{name} is {value!r}; choose one of {', '.join(allowed)}")
        unknown = [name for name in self.passes if name not in PASSES]
        if unknown or not self.passes:
            raise Refused(f"passes are {self.passes!r}; choose from {', '.join(PASSES)}")
        _check_range("resolution", self.resolution, *RESOLUTION_RANGE)
        if self.height is not None:
            _check_range("height", self.height, *RESOLUTION_RANGE)
        self._check_atlas()
        _check_range("error", self.target_error, *ERROR_RANGE)
        _check_range("margin", self.margin, 0, 1024)
        _check_range("threads", self.threads, 0, 1024)
        _check_range("seed", self.seed, 0, 2**31 - 1)
        if self.scale is not None:
            _check_range("scale", self.scale, 0.0, 1e9)
        if self.time_limit is not None:
            _check_range("time_limit", self.time_limit, 0.1, 1e6)
        if not self.name.strip():
            raise Refused("name is empty; give the color attribute and images a name")
        check_name(self.name)

    def _check_atlas(self) -> None:
        """``check`` of what concerns an atlas."""
        if self.atlas is not None and not self.atlas.strip():
            raise Refused("atlas is empty; give the shared image a name")
        _check_range("atlas_images", self.atlas_images, *ATLAS_IMAGES_RANGE)
        if self.density is not None:
            _check_range("density", self.density, *DENSITY_RANGE)
        packs = self.density is not None or self.atlas_images > 1
        if packs and self.atlas is None:
            raise Refused("density and atlas_images are of an atlas; name one")
        if self.uv_map is not None and (packs or self.unwrap != "smart"):
            raise Refused(
                f"density, atlas_images and unwrap are for a map that is made, and {self.uv_map!r} is "
                "used as it is; leave them out, or the uv_map"
            )


def check_name(name: str) -> None:
    """Raise Refused for what is too long for an attribute's name."""
    if len(name.encode()) > LONGEST_NAME:
        raise Refused(f"name {name!r} has more than {LONGEST_NAME} bytes; choose a shorter one")


def _check_range(name: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        least, most = (f"{end:,}".removesuffix(".0") for end in (low, high))
        raise Refused(f"{name} is {value}; it must lie between {least} and {most}")
