"""Illumination: what lights a scene beside its surfaces. bpy."""

from __future__ import annotations

from dataclasses import dataclass

from ..solver.scene import Sky
from .images import working_space_is_rec709
from .light_links import emission_links, lit_objects, shading_objects
from .light_objects import Light
from .parts import Part
from .sockets import Reader
from .traceless import traceless
from .world import read_world


@dataclass(frozen=True)
class Illumination:
    """What lights the scene beside its surfaces, and which objects lamps and emission light, and which
    shade them: see ``Scene``."""

    lights: list[Light]
    sky: Sky | None
    lamp_objects: tuple
    lamp_blockers: tuple
    emission_objects: tuple
    emission_blockers: tuple


def find_illumination(
    scene, parts: list[Part], palette, lights: list[Light], warnings
) -> Illumination:
    """The world's light beside ``lights``, and what is linked to all of them."""
    with traceless():
        sky, suns = read_world(scene, Reader(working_space_is_rec709()), warnings)
        lights = [*lights, *(Light(sun) for sun in suns)]
        shaded = lit_objects(lights, parts), shading_objects(lights, parts)
        return Illumination(lights, sky, *shaded, *emission_links(parts, palette))
