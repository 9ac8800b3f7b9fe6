"""Solve cache: solves of one scene, for baking it again without repeating what has not changed.

What a solve depends on falls into three parts, each known by its digest: the *shape* (surfaces,
what they reflect, where lights are), the *light* (how bright and of what colour they are), and the
receivers that were looked from. The same shape and light need no solve at all; other light needs
shadow rays and the linear system, but no rays between surfaces.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, is_dataclass, replace
from hashlib import blake2b

import numpy as np

from ..lights.context import Context
from ..materials.channels import channels_of
from ..receivers import Receivers
from ..sampling.streams import Stream
from ..scene import LAMP_COLOR, Scene, lamp_color, sides
from ..transport.lit_patches import light_points
from ..transport.radiosity import Radiosity, solve_rows
from .plan import Plan

SOLUTION, TRANSPORT = "solution", "transport"  # what of an earlier bake was used again


@dataclass(frozen=True)
class Solve:
    """What ``plan`` gave: a Radiosity for each half."""

    plan: Plan
    halves: tuple[Radiosity, ...]


@dataclass
class SolveCache:
    """The solves of the last bake, coarse to fine. Can be pickled.

    Call ``expect`` for the scene to be baked, then ``find`` before each solve and ``add`` after it.
    ``reused`` then tells what ``find`` gave: "", SOLUTION or TRANSPORT.
    """

    solves: list[Solve] = field(default_factory=list)
    shape: str = ""  # digests of what the solves were made for
    light: str = ""
    receivers: str = ""
    unit: float = 1.0  # what their light is divided by
    reused: str = ""
    changed: bool = False  # since ``expect``
    _now: tuple[str, str, str] = ("", "", "")  # digests of what is baked now

    def expect(self, scene: Scene, receivers: Receivers, seed: int) -> None:
        """Forget what does not fit this scene, its baked objects, or the seed."""
        shape, light = shape_digest(scene, receivers, seed), light_digest(scene)
        if shape != self.shape:
            self.solves = []
        cells = (receivers.receiver, receivers.triangle, receivers.corners, receivers.square)
        if receivers.shading is not None:
            cells += (receivers.shading,)
        self._now, self.reused, self.changed = (shape, light, digest(cells)), "", False

    def find(self, context: Context, plan: Plan, tolerance: float):
        """(plan, radiosities) of a solve at least as fine as ``plan``, or None.

        For the same receivers and light the very solve that ``plan`` asks for is preferred, so
        that the result is what a bake from scratch gives; else the finest one.
        """
        fine = [solve for solve in self.solves if _as_fine(solve.plan, plan)]
        if not fine:
            return None
        chosen = fine[-1]
        if self._now[1] != self.light:
            chosen = self._lit_anew(context, chosen, tolerance)
        elif self._now[2] == self.receivers:
            chosen = next((solve for solve in fine if _same(solve.plan, plan)), chosen)
        self.reused = self.reused or SOLUTION
        made = chosen.plan
        return replace(plan, elements=made.elements, row_rays=made.row_rays), list(chosen.halves)

    def add(self, context: Context, plan: Plan, radiosities: list[Radiosity]) -> None:
        """Keep a solve of the scene that is expected."""
        if self._now != (self.shape, self.light, self.receivers):
            self.solves = []
            self.shape, self.light, self.receivers = self._now
        self.solves.append(Solve(plan, tuple(radiosities)))
        self.unit, self.reused, self.changed = context.unit, "", True

    def shrunk(self, most: int) -> SolveCache:
        """With the coarsest solves left out until the arrays take at most ``most`` bytes."""
        solves = list(self.solves)
        while solves and size(solves) > most:
            solves.pop(0)
        return replace(self, solves=solves)

    def _lit_anew(self, context: Context, solve: Solve, tolerance: float) -> Solve:
        halves = tuple(
            lit_anew(context, half, self.unit, tolerance, (context.seed, Stream.RELIGHT, number))
            for number, half in enumerate(solve.halves)
        )
        self.solves = [replace(solve, halves=halves)]
        self.light, self.unit, self.reused = self._now[1], context.unit, TRANSPORT
        self.changed = True
        return self.solves[0]


def lit_anew(context: Context, half: Radiosity, unit: float, tolerance: float, key) -> Radiosity:
    """The same elements and rows under the context's lamps: direct light at the points that the
    rows start from, and the linear system. ``unit`` is what the rows' sky was divided by."""
    blocks = []
    for number, block in enumerate(half.transport.blocks):
        _, lit, spread = light_points(context, block.patches.points, (*key, number))
        patches = replace(block.patches, lit=lit, spread=spread)
        found = block.found
        if block.onward is not None:
            found = sum(block.onward.light(context, (*key, number, 1))) / block.rays
        sky = block.sky * (unit / context.unit)
        blocks.append(replace(block, patches=patches, sky=sky, found=found))
    transport = replace(half.transport, blocks=tuple(blocks))
    return solve_rows(context, half.patches, transport, tolerance)


def _as_fine(kept: Plan, asked: Plan) -> bool:
    return (
        kept.elements >= asked.elements
        and kept.row_rays >= asked.row_rays
        and kept.row_points >= asked.row_points
        and kept.goal <= asked.goal
    )


def _same(kept: Plan, asked: Plan) -> bool:
    """Whether both plans give one solve: their rays to receivers do not matter."""
    return kept == replace(asked, enough=kept.enough, points=kept.points, rays=kept.rays)


def shape_digest(scene: Scene, receivers: Receivers, seed: int) -> str:
    """Of everything that rays between surfaces depend on, whether anything is coloured, and
    whether each light shines at all: elements are small where the shadows of those that do have
    their edges. The sky counts as shape: rows remember what their rays brought from it."""
    baked = np.unique(scene.object[receivers.triangle])
    surfaces = [(m.reflectance, m.transmittance, _shines(m.emission), m.back is None)
                for m in sides(scene.materials)]  # fmt: skip
    places = [(replace(lamp, name="", **{LAMP_COLOR[type(lamp)]: None}), _shines(lamp))
              for lamp in scene.lamps]  # fmt: skip
    return digest(
        seed, channels_of(scene), baked, scene.vertices, scene.triangles, scene.material,
        scene.object, surfaces, places, scene.lamp_objects, scene.lamp_blockers, scene.sky,
        scene.casts_shadow, scene.visible,
    )  # fmt: skip


def light_digest(scene: Scene) -> str:
    """Of the colours and strengths of lamps and of what emits."""
    lamps = [lamp_color(lamp) for lamp in scene.lamps]
    return digest(lamps, [material.emission for material in sides(scene.materials)])


def _shines(thing) -> tuple[str, bool]:
    """The kind of a lamp or an emission field, and whether it gives any light."""
    names = (*LAMP_COLOR.values(), "value", "factor", "values")
    values = [getattr(thing, name, 1.0) for name in names]
    return type(thing).__name__, all(np.any(np.asarray(v) > 0) for v in values)


def digest(*things) -> str:
    """A fingerprint of nested dataclasses, sequences, arrays and plain values."""
    state = blake2b(digest_size=16)
    _feed(state, things)
    return state.hexdigest()


def _feed(state, thing) -> None:
    if isinstance(thing, np.ndarray):
        state.update(f"{thing.dtype.str}{thing.shape}".encode() + thing.tobytes())
    elif is_dataclass(thing):
        _feed(state, (type(thing).__name__, *(getattr(thing, f.name) for f in fields(thing))))
    elif isinstance(thing, (tuple, list)):
        state.update(f"({len(thing)}".encode())
        for part in thing:
            _feed(state, part)
    else:
        state.update(f"{thing!r};".encode())


def size(thing) -> int:
    """Bytes of all arrays in nested dataclasses and sequences."""
    if isinstance(thing, np.ndarray):
        return thing.nbytes
    if is_dataclass(thing):
        return sum(size(getattr(thing, f.name)) for f in fields(thing))
    return sum(map(size, thing)) if isinstance(thing, (tuple, list)) else 0
