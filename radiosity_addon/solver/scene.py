"""Scene: what the solver is given. Triangles, materials, lamps and sky, free of Blender.

Lengths are in any one unit; the solver normalizes. Colors are linear, in whatever RGB working
space the caller uses; ``emission`` is a radiance [W/m²/sr] (an Emission shader of strength 1 has
radiance 1), and exitance is π times that.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Literal, Protocol

import numpy as np

from .fields import Constant, Field

BLACK = Constant(np.zeros(3))
WHITE = Constant(np.ones(3))


@dataclass(frozen=True)
class Material:
    """A matte two-sided surface.

    ``reflectance`` in [0, 1]: the share of light that goes on to other surfaces; ``emission`` radiance;
    ``transmittance`` in [0, 1]: the share of light that goes straight through, tinted (alpha cutouts,
    glass). A point that is lit through a surface sees one side of it, and that side's transmittance
    counts. ``diffuse`` in [0, 1]: what baked light is multiplied by, where gloss is a part of the
    reflectance but not of what is baked.
    """

    name: str
    reflectance: Field = WHITE
    emission: Field = BLACK
    transmittance: Field = BLACK
    back: Material | None = None  # what is seen from behind; None: the same
    diffuse: Field | None = None  # None: the reflectance

    @property
    def diffuse_reflectance(self) -> Field:
        """``diffuse``, or the reflectance where it is None."""
        return self.reflectance if self.diffuse is None else self.diffuse


# What of a material is asked for, by its name.
Quantity = Literal["reflectance", "diffuse_reflectance", "emission", "transmittance"]


def sides(materials: tuple[Material, ...]) -> list[Material]:
    """The materials, and those that some have on their back."""
    return [*materials, *(material.back for material in materials if material.back)]


class Lamp(Protocol):
    """What every type of lamp has. A lamp is a frozen dataclass; all its numbers are checked to be finite.

    ``color_field`` names the field (3,) that tells how bright it is, in the lamp's own unit.
    ``takes_distribution``: whether it has a field ``distribution`` by which it may shine as a node
    tree shapes it, see ``PointLamp``.
    """

    color_field: ClassVar[str]
    takes_distribution: ClassVar[bool]

    @property
    def name(self) -> str: ...

    @property
    def middle(self) -> np.ndarray | None:
        """(3,) where it is; None: infinitely far."""


@dataclass(frozen=True)
class PointLamp:
    """A disk of ``radius`` that faces every point it lights, as in Cycles; a ``sphere`` is one.

    ``intensity`` (3,) is its radiant intensity [W/sr] (P/4π for P watts).

    A spot has ``axis`` (3,) unit, the direction it shines in; ``cone`` the full cone angle
    [rad] and ``blend`` in [0, 1]; for a point lamp ``axis`` is None.

    ``distribution`` (height, width) float32 in [0, 1] multiplies the intensity, by the direction in
    which light leaves, laid out as a ``Sky``'s pixels and linear between their middles; None: 1.
    """

    color_field: ClassVar[str] = "intensity"
    takes_distribution: ClassVar[bool] = True

    name: str
    position: np.ndarray  # (3,)
    intensity: np.ndarray  # (3,)
    radius: float = 0.0
    axis: np.ndarray | None = None
    cone: float = np.pi
    blend: float = 0.0
    sphere: bool = False
    distribution: np.ndarray | None = None

    @property
    def middle(self) -> np.ndarray:
        """See ``Lamp``."""
        return self.position


@dataclass(frozen=True)
class SunLamp:
    """A distant disk. ``direction`` (3,) unit, in which light travels; ``irradiance`` (3,) [W/m²]
    on a surface that faces it; ``angle`` its full angular diameter [rad]."""

    color_field: ClassVar[str] = "irradiance"
    takes_distribution: ClassVar[bool] = False

    name: str
    direction: np.ndarray
    irradiance: np.ndarray
    angle: float = 0.0

    @property
    def middle(self) -> None:
        """See ``Lamp``."""
        return None


@dataclass(frozen=True)
class AreaLamp:
    """A one-sided flat lamp; it blocks no light.

    Rectangle ``center ± u/2 ± v/2``, or the ellipse with these diameters when ``ellipse``.
    ``normal`` (3,) unit: the side that shines. ``radiance`` (3,). ``spread`` [rad] as in Cycles:
    π is plain Lambertian, less narrows the beam.
    """

    color_field: ClassVar[str] = "radiance"
    takes_distribution: ClassVar[bool] = False

    name: str
    center: np.ndarray
    u: np.ndarray
    v: np.ndarray
    normal: np.ndarray
    radiance: np.ndarray
    ellipse: bool = False
    spread: float = np.pi

    @property
    def middle(self) -> np.ndarray:
        """See ``Lamp``."""
        return self.center


def lamp_color(lamp: Lamp) -> np.ndarray:
    """(3,) how bright a lamp is, in its own unit."""
    return getattr(lamp, lamp.color_field)


@dataclass(frozen=True)
class Sky:
    """Radiance from infinitely far: ``pixels`` (height, width, 3) float32, equirectangular as in
    Cycles (row 0 at the nadir, column 0 at direction −x, increasing u turning clockwise seen from
    above: u = −atan2(y, x)/2π + 1/2, v = atan2(z, hypot(x, y))/π + 1/2). A constant sky has 1 × 1.
    """

    pixels: np.ndarray


@dataclass(frozen=True)
class Scene:
    """Triangles with materials; lamps; a sky; the names they came from.

    The front of a triangle is where its vertices turn counter-clockwise. Both sides reflect and
    emit, as their materials say; receivers are fronts. ``casts_shadow`` and ``visible`` (to diffuse
    rays) are per object. ``lamp_objects``: for each lamp the objects it lights (indices), or None
    for all of them; ``lamp_blockers``: the same of those that shade its light.
    ``emission_objects`` and ``emission_blockers`` are the same of what each object emits.
    """

    vertices: np.ndarray  # (n_vertices, 3) float64
    triangles: np.ndarray  # (n_triangles, 3) int32
    material: np.ndarray  # (n_triangles,) int32, into materials
    object: np.ndarray  # (n_triangles,) int32, into objects
    materials: tuple[Material, ...]
    objects: tuple[str, ...]
    lamps: tuple[Lamp, ...] = ()
    sky: Sky | None = None
    casts_shadow: np.ndarray | None = None  # (n_objects,) bool; None: all do
    visible: np.ndarray | None = None  # (n_objects,) bool; None: all are
    lamp_objects: tuple[np.ndarray | None, ...] | None = None
    lamp_blockers: tuple[np.ndarray | None, ...] | None = None
    emission_objects: tuple[np.ndarray | None, ...] | None = None
    emission_blockers: tuple[np.ndarray | None, ...] | None = None
    warnings: tuple[str, ...] = field(default=())


def used_sides(scene: Scene, triangles: np.ndarray | slice = slice(None)) -> list[Material]:
    """``sides`` of the materials that some of the triangles have."""
    return sides(tuple(scene.materials[i] for i in np.unique(scene.material[triangles])))
