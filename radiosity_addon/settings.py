"""Settings: the one source of every default."""

from __future__ import annotations

from dataclasses import dataclass

from .solver.passes import Pass

QUALITY_ERROR = {"draft": 0.1, "medium": 0.03, "high": 0.01}
PASSES = tuple(each.value for each in Pass)
TARGETS = ("vertex", "image")
DOMAINS = ("corner", "point")
FORMATS = ("exr", "png", "png16", "hdr", "rgbm", "rgbe")
COLOR_TYPES = ("float", "byte")
RESOLUTION_RANGE = (4, 16384)
ERROR_RANGE = (1e-4, 1.0)


@dataclass(frozen=True)
class Settings:
    """What the user asks of a bake. The command line and the panel only fill this in."""

    objects: tuple[str, ...] = ()  # names of receivers; empty: every renderable mesh
    target: str = "vertex"
    domain: str = "corner"
    resolution: int = 1024  # texels along an image's edge
    uv_map: str | None = None  # None: the map "Radiosity", made where missing
    margin: int = 8  # texels
    image_dir: str | None = None
    format: str | None = None  # of the files in image_dir; None: exr when image_dir is given
    color_type: str = "float"  # of the colour attribute: 32-bit float, or 8 bits a channel
    scale: float | None = None  # divides encoded values; 0: the brightest; None: 1, RGBM: 0
    name: str = "Radiosity"
    passes: tuple[str, ...] = PASSES
    quality: str = "medium"
    error: float | None = None  # target relative error; None: that of the quality
    shading_normals: bool = True  # light counts as faces are shaded; False: as they lie
    time_limit: float | None = None  # seconds of solving; None: no limit
    seed: int = 0
    threads: int = 0  # 0: all cores

    @property
    def target_error(self) -> float:
        """The relative error asked for, local and over the surface (docs/theory.md)."""
        return QUALITY_ERROR[self.quality] if self.error is None else self.error

    def check(self) -> None:
        """Raise ValueError naming the first setting out of range, its value, limit and remedy."""
        for name, value, allowed in (
            ("target", self.target, TARGETS),
            ("domain", self.domain, DOMAINS),
            ("quality", self.quality, tuple(QUALITY_ERROR)),
            ("format", self.format or "exr", FORMATS),
            ("color_type", self.color_type, COLOR_TYPES),
        ):
            if value not in allowed:
                raise ValueError(f"{name} is {value!r}; choose one of {', '.join(allowed)}")
        unknown = [name for name in self.passes if name not in PASSES]
        if unknown or not self.passes:
            raise ValueError(f"passes are {self.passes!r}; choose from {', '.join(PASSES)}")
        _check_range("resolution", self.resolution, *RESOLUTION_RANGE)
        _check_range("error", self.target_error, *ERROR_RANGE)
        _check_range("margin", self.margin, 0, 1024)
        _check_range("threads", self.threads, 0, 1024)
        _check_range("seed", self.seed, 0, 2**31 - 1)
        if self.scale is not None:
            _check_range("scale", self.scale, 0.0, 1e9)
        if self.time_limit is not None:
            _check_range("time_limit", self.time_limit, 0.1, 1e6)
        if not self.name.strip():
            raise ValueError("name is empty; give the colour attribute and images a name")


def _check_range(name: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        raise ValueError(f"{name} is {value}; it must lie between {low} and {high}")
