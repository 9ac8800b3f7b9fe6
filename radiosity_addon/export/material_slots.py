"""Material slots: from the parts' slots to the scene's materials.

A material that can be read gives one scene material for all parts; one that Cycles has to
evaluate gives one per part, because its color may depend on the object.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..figures import quoted
from ..settings import Pass, Settings
from ..solver.scene import Material
from .colors import NO_LIGHT, Color, NotSimple, constant, extremes, sound, to_field, values
from .images import working_space_is_rec709
from .parts import material_key
from .remarks import bare_remarks, fed_back_remarks, material_remarks, moved_remarks
from .shaders import SurfaceShader, read_sides
from .sockets import Reader

DEFAULT_REFLECTANCE = 0.8  # reflectance [of 1] of a face without material, as in Cycles
DULL = 1 / 3  # error [of what dull coatings mirror] in rooms whose light goes all around instead (docs/parity.md)
MOSTLY_GLOSSY = 0.5  # share [of the light]: a material that mirrors more is named as a mirror


@dataclass
class Palette:
    """The surfaces read so far, and who uses them."""

    # Name, front and back of each.
    surfaces: list[tuple[str, SurfaceShader, SurfaceShader | None]] = field(default_factory=list)
    index: dict = field(default_factory=dict)  # material key -> index; None: Cycles evaluates
    difficult: dict = field(default_factory=dict)  # material key -> why it is not simple
    per_part: dict = field(default_factory=dict)  # (part index, key) -> index, where evaluated
    lookups: dict = field(default_factory=dict)  # part index -> (mesh triangles, places (k, 3, 2) in pictures)
    warnings: list[str] = field(default_factory=list)

    def add(self, name: str, front: SurfaceShader, back: SurfaceShader | None = None) -> int:
        """Check and keep a surface, and that of its back where it is another one."""
        sides = [None if s is None else checked(s, name, self.warnings) for s in (front, back)]
        self.surfaces.append((name, *sides))
        return len(self.surfaces) - 1

    def number(self, part_index: int, key) -> int | None:
        """Which surface a part has for a material key; None before it is evaluated."""
        simple = self.index.get(key)
        return self.per_part.get((part_index, key)) if simple is None else simple

    def glows(self, part_index: int, part) -> bool:
        """Whether any of the part's surfaces may emit."""
        numbers = [self.number(part_index, key) for key in part.materials]
        sides = [side for n in numbers if n is not None for side in self.surfaces[n][1:] if side]
        return any(not side.emission.is_black for side in sides)


def read_materials(parts, gloss: bool) -> Palette:
    """Read every material that a triangle of the parts uses; ``gloss``: and what it mirrors."""
    import bpy

    known = {material_key(material): material for material in bpy.data.materials}
    palette, reader = Palette(), Reader(working_space_is_rec709(), gloss)
    for key in _used(parts):
        material = known.get(key)
        if material is None:
            surface = SurfaceShader(constant(DEFAULT_REFLECTANCE))
            palette.index[key] = palette.add(key or "(none)", surface)
            continue
        palette.warnings.extend(material_remarks(material))
        try:
            front, back = read_sides(material, reader)
        except NotSimple as reason:
            palette.index[key] = None
            palette.difficult[key] = str(reason)
            continue
        palette.index[key] = palette.add(material.name, front, back)
    read = [known[key] for key in _used(parts) if key in known]
    palette.warnings.extend(moved_remarks(read) + fed_back_remarks(read))
    palette.warnings.extend(bare_remarks(parts))
    return palette


def slot_keys(part) -> np.ndarray:
    """(n_triangles,) slot of each triangle; slots past the end mean the last, as in Cycles."""
    return np.clip(part.mesh.slot, 0, len(part.materials) - 1)


def _used(parts) -> list:
    """Material keys in order of first use."""
    keys = {}
    for part in parts:
        for slot in np.unique(slot_keys(part)):
            keys.setdefault(part.materials[slot], None)
    return list(keys)


def checked(surface: SurfaceShader, name: str, warnings: list[str]) -> SurfaceShader:
    """The surface with reflectances and transmittance cut to [0, 1] and emission to [0, inf). Warnings name what was
    cut; a ``reflectance`` that goes with the diffuse one gets no warning of its own."""
    diffuse = _clamped(surface.diffuse, 1.0, name, "reflectance", warnings)
    sent = surface.reflectance
    of_one = diffuse is surface.diffuse and diffuse.pixels is not None
    if sent is not None and not (of_one and sent.pixels is diffuse.pixels):
        sent = _clamped(sent, 1.0, name, "reflectance", [])  # else it is a share of what is sound
    return replace(
        surface,
        diffuse=diffuse,
        emission=_clamped(surface.emission, np.inf, name, "emission", warnings),
        transmittance=_clamped(surface.transmittance, 1.0, name, "transmittance", warnings),
        reflectance=sent,
    )


def _clamped(color: Color, limit: float, name: str, what: str, warnings: list[str]) -> Color:
    """The color with its values in [0, ``limit``], and a warning where some were not; ``what`` it is a
    color of."""
    if color.attribute is not None:
        return color
    ends = extremes(color)
    bad = sound(ends)[1]
    bright = bool(np.any(ends > limit + 1e-6))
    if not bad and not bright:
        return color
    if bad:
        warnings.append(f'material "{name}": {what} that is {NO_LIGHT} is taken as 0')
    if bright:
        top = float(np.nanmax(ends))
        warnings.append(f'material "{name}": {what} {top:.3g} is above 1; it is clamped to 1')
    kept = np.minimum(sound(values(color))[0], limit)
    if color.pixels is None:
        return constant(kept)
    return Color(np.ones(3), pixels=kept, mapping=color.mapping)


def gloss_remarks(palette: Palette, settings: Settings) -> list[str]:
    """A warning where what materials mirror is left out, or does not go where it would, and more of it than
    the error asked for matters: neither is in the estimated error."""
    if Pass.INDIRECT not in settings.passes:
        return []
    return _misdirected(palette, settings) if settings.glossy_bounces else _left_out(palette, settings)


def _misdirected(palette: Palette, settings: Settings) -> list[str]:
    """What to warn of where mirrored light goes on as from matte surfaces."""
    shares = {
        name: front.glossy
        for name, front, _ in palette.surfaces
        if front.sharp + DULL * (front.glossy - front.sharp) > settings.target_error
    }
    if not shares:
        return []
    mirrors = [name for name, share in shares.items() if share > MOSTLY_GLOSSY]
    return [
        f"metals, gloss and coatings mirror up to {100 * max(shares.values()):.0f} % of the light. In the bake, this light "
        "goes on in all directions, as from matte surfaces. The estimated error does not include what that changes. "
        f"Materials: {quoted(list(shares))}",
        *([f"materials that mostly mirror are dark in the bake, which shows the diffuse part alone: {quoted(mirrors)}"]
          if mirrors else []),
    ]


def _left_out(palette: Palette, settings: Settings) -> list[str]:
    """What to warn of where mirrored light is left out."""
    shares = {name: front.glossy for name, front, _ in palette.surfaces}
    mirrors = [name for name, share in shares.items() if share > MOSTLY_GLOSSY]
    coated = {
        name: share for name, share in shares.items() if settings.target_error < share <= MOSTLY_GLOSSY
    }
    said = []
    if mirrors:
        said.append(f"of materials that mostly mirror, only the diffuse part is solved: {quoted(mirrors)}")
    if coated:
        said.append(
            f"glossy bounces are off: the light that coatings mirror, up to {100 * max(coated.values()):.0f} %, is left out. "
            "Indirect light is darker than in Cycles by about as much, and by more in bright closed rooms. The estimated "
            f"error does not include that. Materials: {quoted(list(coated))}"
        )
    return said


def scene_materials(palette: Palette, uv_of, corners_of) -> tuple[Material, ...]:
    """The solver's materials; see ``colors.to_field`` for the two functions."""

    def fields(surface: SurfaceShader):
        yield to_field(surface.sent_on, uv_of, corners_of, 1.0)
        yield to_field(surface.emission, uv_of, corners_of, np.inf)
        yield to_field(surface.transmittance, uv_of, corners_of, 1.0)

    def diffuse(surface: SurfaceShader):
        return surface.reflectance and to_field(surface.diffuse, uv_of, corners_of, 1.0)

    def material(name: str, surface: SurfaceShader, back: Material | None) -> Material:
        return Material(name, *fields(surface), back, diffuse(surface))

    return tuple(
        material(name, front, back and material(f"{name} (back)", back, None))
        for name, front, back in palette.surfaces
    )
