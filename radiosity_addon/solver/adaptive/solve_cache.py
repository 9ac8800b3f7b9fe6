"""Solve cache: solves of one scene, for baking it again without repeating what has not changed.

What a solve depends on falls into three parts, each known by its digest: the *shape* (surfaces,
what they reflect, where lights are), the *light* (how bright and of what color they are), and the
receivers that were looked from. The same shape and light need no solve at all; other light needs
shadow rays and the linear system, but no rays between surfaces.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, is_dataclass, replace
from hashlib import blake2b

import numpy as np

from ..fields import Field
from ..lights.context import Context
from ..materials.channels import channels_of
from ..receivers import Receivers
from ..sampling.streams import Stream
from ..scene import Lamp, Scene, lamp_color, sides
from ..transport.lit_patches import light_points, light_receivers
from ..transport.radiosity import Radiosity, solve_rows
from .plan import Plan

SOLUTION, TRANSPORT = "solution", "transport"  # words: what of an earlier bake was used again


@dataclass(frozen=True)
class SceneKey:
    """Digests of what is solved: the shape, the light, and the receivers that were looked from."""

    shape: str
    light: str
    receivers: str


@dataclass(frozen=True)
class SolveKey:
    """What a solve depends on, and how fine it is."""

    scene: SceneKey
    plan: Plan


@dataclass(frozen=True)
class Solve:
    """What ``plan`` gave: a Radiosity for each replicate, its light divided by ``unit``."""

    plan: Plan
    replicates: tuple[Radiosity, Radiosity]
    unit: float


@dataclass
class SolveCache:
    """The solves of the last bake, coarse to fine. Can be pickled.

    Call ``begin`` for the scene to be baked, then ``get`` before each solve and ``put`` after it
    (``cached_solve`` also lights anew what it gets). ``reused`` then tells what was got:
    "", SOLUTION or TRANSPORT.
    """

    solves: dict[SolveKey, Solve] = field(default_factory=dict)
    scene: SceneKey | None = None  # what is baked now
    reused: str = ""
    changed: bool = False  # since ``begin``

    def begin(self, scene: SceneKey) -> None:
        """Forget the solves of other shapes."""
        self.solves = {k: v for k, v in self.solves.items() if k.scene.shape == scene.shape}
        self.scene, self.reused, self.changed = scene, "", False

    def key(self, plan: Plan) -> SolveKey:
        """Of a solve of what is baked now."""
        return SolveKey(self.scene, plan)

    def get(self, key: SolveKey) -> tuple[SolveKey, Solve] | None:
        """A solve of this shape, at least as fine as the key's plan, and its own key; or None.

        For the same receivers and light the very solve that is asked for is preferred, so that the
        result is what a bake from scratch gives; else the finest one.
        """
        fine = [
            (kept, solve) for kept, solve in self.solves.items()
            if kept.scene.shape == key.scene.shape and _as_fine(kept.plan, key.plan)
        ]  # fmt: skip
        same = [(kept, solve) for kept, solve in fine
                if kept.scene == key.scene and _same(kept.plan, key.plan)]  # fmt: skip
        return (same[:1] or fine[-1:] or [None])[0]

    def put(self, key: SolveKey, solve: Solve) -> None:
        """Keep a solve, and of the others those of the same scene."""
        self.solves = {k: v for k, v in self.solves.items() if k.scene == key.scene}
        self.solves[key] = solve
        self.reused, self.changed = "", True

    def shrunk(self, most: int) -> SolveCache:
        """With the coarsest solves left out until the arrays take at most ``most`` bytes."""
        solves = dict(self.solves)
        while solves and array_bytes(list(solves.values())) > most:
            del solves[next(iter(solves))]
        return replace(self, solves=solves)


def cached_solve(
    cache: SolveCache, plan: Plan, context: Context, tolerance: float
) -> Solve | None:
    """A kept solve of what is baked now that is at least as fine as ``plan``, under the context's
    lamps; None where there is none."""
    found = cache.get(cache.key(plan))
    if found is None:
        return None
    key, solve = found
    if key.scene.light != cache.scene.light:
        solve = _relit(context, solve, tolerance)
        cache.put(replace(key, scene=replace(key.scene, light=cache.scene.light)), solve)
        cache.reused = TRANSPORT
    cache.reused = cache.reused or SOLUTION
    return solve


def _relit(context: Context, solve: Solve, tolerance: float) -> Solve:
    replicates = tuple(
        relit(context, each, solve.unit, tolerance, (context.seed, Stream.RELIGHT, number))
        for number, each in enumerate(solve.replicates)
    )
    return replace(solve, replicates=replicates, unit=context.unit)


def relit(
    context: Context, radiosity: Radiosity, unit: float, tolerance: float, key: tuple[int, ...]
) -> Radiosity:
    """The same elements and rows under the context's lamps: direct light at the points that the
    rows start from, and the linear system. ``unit`` is what the rows' sky was divided by."""
    blocks = []
    for number, block in enumerate(radiosity.transport.blocks):
        _, lit, deviation = light_points(context, block.patches.points, (*key, number))
        patches = replace(block.patches, lit=lit, deviation=deviation)
        found = block.found
        if block.onward is not None:
            found = sum(block.onward.light(context, (*key, number, 1))) / block.rays
        sky = block.sky * (unit / context.unit)
        blocks.append(replace(block, patches=patches, sky=sky, found=found))
    transport, own = replace(radiosity.transport, blocks=tuple(blocks)), radiosity.patches.receivers
    other_lit = None
    if own is not None:
        lit = light_receivers(context, own.footprints, transport.samples.patch_points, (*key, len(blocks)))
        other_lit = lit.lit.astype(np.float32)
    return replace(solve_rows(context, radiosity.patches, transport, tolerance), other_lit=other_lit)


def _as_fine(kept: Plan, asked: Plan) -> bool:
    return (
        kept.elements >= asked.elements
        and kept.row_rays >= asked.row_rays
        and kept.row_points >= asked.row_points
        and kept.goal <= asked.goal
    )


def _same(kept: Plan, asked: Plan) -> bool:
    """Whether both plans give one solve: their rays to receivers do not matter, nor what elements were refined for."""
    return kept == replace(asked, enough=kept.enough, points=kept.points, rays=kept.rays, excess=kept.excess)


def scene_key(scene: Scene, receivers: Receivers, seed: int) -> SceneKey:
    """The key of a scene, its baked objects, and the seed."""
    cells = (receivers.receiver, receivers.triangle, receivers.corners, receivers.square)
    if receivers.shading is not None:
        cells += (receivers.shading,)
    shape, light = shape_digest(scene, receivers, seed), light_digest(scene)
    return SceneKey(shape, light, digest(cells))


def shape_digest(scene: Scene, receivers: Receivers, seed: int) -> str:
    """Of everything that rays between surfaces depend on, whether anything is colored, and
    whether each light shines at all: elements are small where the shadows of those that do have
    their edges. The sky counts as shape: rows remember what their rays brought from it."""
    baked = np.unique(scene.object[receivers.triangle])
    surfaces = [(m.reflectance, m.diffuse, m.transmittance, _glows(m.emission), m.back is None)
                for m in sides(scene.materials)]  # fmt: skip
    lamps = [(replace(lamp, name="", **{lamp.color_field: None}), _shines(lamp))
              for lamp in scene.lamps]  # fmt: skip
    return digest(
        seed, channels_of(scene), baked, scene.vertices, scene.triangles, scene.material,
        scene.object, surfaces, lamps, scene.lamp_objects, scene.lamp_blockers, scene.sky,
        scene.casts_shadow, scene.visible, scene.emission_objects, scene.emission_blockers,
    )  # fmt: skip


def light_digest(scene: Scene) -> str:
    """Of the colors and strengths of lamps and of what emits."""
    lamps = [lamp_color(lamp) for lamp in scene.lamps]
    return digest(lamps, [material.emission for material in sides(scene.materials)])


def _shines(lamp: Lamp) -> tuple[str, bool]:
    """The type of a lamp, and whether it gives any light."""
    return type(lamp).__name__, bool(np.any(np.asarray(lamp_color(lamp)) > 0))


def _glows(field: Field) -> tuple[str, bool]:
    """The type of a field of emission, and whether it may give any light."""
    values = [getattr(field, name, 1.0) for name in ("value", "factor", "values")]
    return type(field).__name__, all(np.any(np.asarray(v) > 0) for v in values)


def digest(*things: object) -> str:
    """A fingerprint of nested dataclasses, sequences, arrays and plain values."""
    state = blake2b(digest_size=16)
    _feed(state, things)
    return state.hexdigest()


def _feed(state: blake2b, thing: object) -> None:
    """Add all that a thing holds to a digest: arrays by their type, shape and bytes."""
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


def array_bytes(thing: object) -> int:
    """Bytes of all arrays in nested dataclasses and sequences."""
    if isinstance(thing, np.ndarray):
        return thing.nbytes
    if is_dataclass(thing):
        return sum(array_bytes(getattr(thing, f.name)) for f in fields(thing))
    return sum(map(array_bytes, thing)) if isinstance(thing, (tuple, list)) else 0
