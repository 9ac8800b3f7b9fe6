"""Sources: which of a scene's lights are sampled explicitly, gathered into batches."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..array_struct import ArrayStruct
from ..expected import Refused
from ..geometry.triangles import Geometry
from ..scene import AreaLamp, Lamp, PointLamp, Scene, SunLamp, lamp_color
from ..tracing.embree import Tracer
from .emissive_faces import emissive_faces
from .facing_disks import batch_of_point_lamps
from .light_batch import LightBatch
from .light_range import useful_lights
from .light_sampler import FEW, LightSampler, make_light_sampler
from .light_tree import Emitters
from .polygons import Polygons, batch_of_area_lamps
from .sky_spots import SkySpots
from .spheres import batch_of_spheres, is_sphere
from .suns import batch_of_suns


@dataclass(frozen=True)
class Sources:
    """All explicit lights, numbered through their batches."""

    batches: tuple[LightBatch, ...]  # Polygons, FacingDisks, SphereLights, Suns, SkySpots
    batch: np.ndarray  # (n,) int: which batch a light belongs to
    index: np.ndarray  # (n,) int: its index in there
    link: np.ndarray  # (n,) int: which row of ``allowed`` tells what it lights
    allowed: np.ndarray | None  # (m, n_objects) bool: objects that are lit; None: always all
    block: np.ndarray  # (n,) int: which row of ``blocking`` tells what shades its light
    blocking: np.ndarray  # (m, n_objects) bool: objects that block; the first row: all
    always: tuple[int, ...]  # lights that are sampled at every point
    samplers: tuple[LightSampler, ...]  # of lights that points choose some of; others light nothing

    @property
    def count(self) -> int:
        return len(self.batch)

    def named(self, light: int) -> tuple[LightBatch, int]:
        """The batch of a light, and its index in there."""
        return self.batches[self.batch[light]], int(self.index[light])

    def importance(
        self, light: np.ndarray, position: np.ndarray, normal: np.ndarray, extent: np.ndarray
    ) -> np.ndarray:
        """Rough irradiance of lights (c, 1) or (c, k, n) at places (3, n), as ``LightBatch.importance``: (c, n)
        or (c, k, n); 0 where a light is −1."""
        batches = np.where(light >= 0, np.take(self.batch, light), -1)
        last = int(batches.max(initial=-1))
        if last >= 0 and (batches[batches >= 0] == last).all():
            index = np.where(light >= 0, np.take(self.index, light), 0)
            found = self.batches[last].importance(index, position, normal, extent)
            return np.where(light >= 0, found, 0)
        importance = np.zeros(np.broadcast_shapes(light.shape, extent.shape))
        wide = np.broadcast_to(light, importance.shape)
        for number in range(last + 1):
            some = np.nonzero(np.broadcast_to(batches == number, importance.shape))
            at = some[-1]
            if len(at):
                importance[some] = self.batches[number].importance(
                    self.index[wide[some]], position[:, at], normal[:, at], extent[at]
                )
        return importance

    def unlinked(
        self, light: int | np.ndarray, scene: Scene, triangle: np.ndarray
    ) -> np.ndarray | None:
        """Bool for places on ``triangle`` (...), whether they lie on objects that their ``light``,
        one or (...), is not linked to; None where all are lit."""
        if self.allowed is None:
            return None
        if np.ndim(light) > 0:
            return ~self.allowed[self.link[light], scene.object[triangle]]
        allowed = self.allowed[self.link[light]]
        return None if allowed.all() else ~allowed[scene.object[triangle]]

    def scaled(self, factor: float) -> Sources:
        """The same lights, ``factor`` times as bright."""
        return replace(self, batches=tuple(replace(k, color=k.color * factor) for k in self.batches))

    def narrowed(self, channels: int) -> Sources:
        """The same lights with the first ``channels`` of their colors."""
        return replace(
            self, batches=tuple(replace(k, color=k.color[:, :channels]) for k in self.batches)
        )

    def used(self) -> np.ndarray:
        """(k,) int: the lights that any point samples."""
        chosen = [sampler.blocks[sampler.blocks >= 0] for sampler in self.samplers]
        return np.unique(np.concatenate([np.array(self.always, int), *chosen]))

    def without(self, lights: np.ndarray) -> Sources:
        """The same with no point sampling ``lights`` (k,) int."""
        always = [light for light in self.always if light not in lights]
        emitters, samplers = Emitters.join([batch.emitters() for batch in self.batches]), []
        for sampler in self.samplers:
            left = np.setdiff1d(sampler.blocks[sampler.blocks >= 0], lights)
            if len(left) <= FEW:
                always += left.tolist()
            else:
                samplers.append(make_light_sampler(left, emitters.take(left), sampler.shading))
        return replace(self, always=tuple(always), samplers=tuple(samplers))

    def only(self, lights: np.ndarray) -> Sources:
        """The same with every point sampling ``lights`` (k,) int and no others."""
        return replace(self, always=tuple(int(light) for light in lights), samplers=())

    def with_polygons(self, polygons: Polygons) -> Sources:
        """With ``polygons`` (k lights), which light all objects and are shaded by all."""
        number, nothing = np.arange(len(polygons.color)), np.zeros(len(polygons.color), int)
        sources = replace(
            self,
            batches=(*self.batches, polygons),
            batch=np.concatenate([self.batch, nothing + len(self.batches)]),
            index=np.concatenate([self.index, number]),
            link=np.concatenate([self.link, nothing]),
            block=np.concatenate([self.block, nothing]),
        )
        added = self.count + number
        if len(added) <= FEW:
            return replace(sources, always=(*self.always, *added.tolist()))
        sampler = make_light_sampler(added, polygons.emitters())
        return replace(sources, samplers=(*self.samplers, sampler))

    def brightest(self) -> float:
        """The largest color component of any light."""
        return max((float(batch.color.max()) for batch in self.batches), default=0.0)


FARTHEST = 1e16  # distance [unit box] of a lamp, at most
# Which scene lamps become which batch, and how, in the order of the batches.
BATCHES: tuple[tuple[Callable[[Lamp], bool], Callable[[list, Geometry], LightBatch]], ...] = (
    (lambda lamp: isinstance(lamp, AreaLamp), batch_of_area_lamps),
    (lambda lamp: isinstance(lamp, PointLamp) and not is_sphere(lamp), batch_of_point_lamps),
    (lambda lamp: isinstance(lamp, PointLamp) and is_sphere(lamp), batch_of_spheres),
    (lambda lamp: isinstance(lamp, SunLamp), batch_of_suns),
)
Links = tuple[Any, Any]  # the objects that a light lights, and those that shade it; None: all


def build_sources(
    scene: Scene, geometry: Geometry, tracer: Tracer, spots: SkySpots | None
) -> tuple[Sources, np.ndarray]:
    """Every light to sample, and (n_triangles,) bool: whose emission that covers."""
    faces, explicit = emissive_faces(scene, geometry, tracer)
    found = _batches(scene, geometry, faces, spots)
    batches = tuple(batch for batch, _ in found)
    sizes = [len(batch.color) for batch in batches]
    batch = np.repeat(np.arange(len(sizes)), sizes)
    index = np.concatenate([np.arange(size) for size in sizes] or [np.zeros(0, int)])
    pairs = [pair for _, own in found for pair in own]
    (link, allowed), (block, blocking) = (
        _links([pair[i] for pair in pairs], len(scene.objects)) for i in (0, 1)
    )
    useful = useful_lights(batches, tuple(pair[0] for pair in pairs), scene, geometry)
    always, samplers = _samplers(batches, batch, useful, block)
    allowed = allowed if len(allowed) > 1 else None
    sources = Sources(batches, batch, index, link, allowed, block, blocking, always, samplers)
    return sources, explicit


def _batches(
    scene: Scene, geometry: Geometry, faces: Polygons, spots: SkySpots | None
) -> list[tuple[LightBatch, list[Links]]]:
    """Batches of emissive ``faces``, of the lamps that shine, and of the sky's bright ``spots``, with
    the links of each light."""
    glow = _pairs(scene.emission_objects, scene.emission_blockers, len(scene.objects))
    lamps = zip(scene.lamps, _pairs(scene.lamp_objects, scene.lamp_blockers, len(scene.lamps)))
    lamps = [(lamp, pair) for lamp, pair in lamps if _shines(lamp)]
    _check_distances([lamp for lamp, _ in lamps], geometry)
    found: list = [(faces, [glow[owner] for owner in faces.object])] if len(faces.color) else []
    for belongs, make in BATCHES:
        mine = [(lamp, pair) for lamp, pair in lamps if belongs(lamp)]
        if mine:
            batch = make([lamp for lamp, _ in mine], geometry)
            found.append((batch, [pair for _, pair in mine]))
    found = _joined(found)
    if spots is not None:
        found.append((spots, [(None, None)] * len(spots.color)))
    return found


def _joined(found: list[tuple[LightBatch, list[Links]]]) -> list[tuple[LightBatch, list[Links]]]:
    """One batch of each type whose batches can be joined, in the order of the first: one is sampled more quickly
    than several. Emissive faces and area lamps are of one type."""
    groups: dict[object, list] = {}
    for number, (batch, links) in enumerate(found):
        same = type(batch) if isinstance(batch, ArrayStruct) else number
        groups.setdefault(same, []).append((batch, links))
    return [
        (batch.join([each for each, _ in pairs]) if len(pairs) > 1 else batch, [link for _, own in pairs for link in own])
        for pairs in groups.values() for batch, _ in pairs[:1]
    ]


def _check_distances(lamps: list[Lamp], geometry: Geometry) -> None:
    """Raise Refused for a lamp so far away for the size of the scene that numbers do not hold its light."""
    for lamp in lamps:
        away = 0.0 if lamp.middle is None else float(np.abs(geometry.normalized(lamp.middle)).max())
        if away > FARTHEST:
            raise Refused(
                f"lamp {lamp.name!r} is {away:.0e} times as far away as the scene is large; move it "
                "nearer, or make it a sun"
            )


def _pairs(lit: tuple | None, shading: tuple | None, count: int) -> list[tuple]:
    """For each of ``count`` lights the objects that it lights, and those that shade it; None: all."""
    free = (None,) * count
    return list(zip(lit or free, shading or free))


def _links(linked: list, objects: int) -> tuple[np.ndarray, np.ndarray]:
    """For each light a row, and (rows, objects) bool, from arrays of object numbers or None for
    all, which are the first row."""
    rows: dict = {None: 0}
    link = np.array([rows.setdefault(None if only is None else np.sort(only).tobytes(), len(rows))
                     for only in linked], int)  # fmt: skip
    table = np.ones((len(rows), objects), bool)
    for row, only in {row: only for row, only in zip(link, linked) if only is not None}.items():
        table[row] = False
        table[row, only] = True
    return link, table


def _samplers(
    batches: tuple[LightBatch, ...], batch: np.ndarray, useful: np.ndarray, block: np.ndarray
) -> tuple[tuple[int, ...], tuple[LightSampler, ...]]:
    """Near and distant lights, apart: those sampled everywhere, and samplers to choose others from.
    Only those that are ``useful`` (n,) bool take part; those of different rows ``block`` (n,) are
    apart, too, so that a choice's shadow rays all meet the same objects."""
    always, samplers = [], []
    for row in np.unique(block[useful]):
        for distant in (False, True):
            mine = [k for k, lights in enumerate(batches) if lights.distant == distant]
            every = np.flatnonzero(np.isin(batch, mine))
            some = useful[every] & (block[every] == row)
            lights = every[some]
            if len(lights) <= FEW:
                always += lights.tolist()
            else:
                emitters = Emitters.join([batches[k].emitters() for k in mine])
                samplers.append(make_light_sampler(lights, emitters.take(some), int(row)))
    return tuple(always), tuple(samplers)


def _shines(lamp: Lamp) -> bool:
    return bool(np.any(np.asarray(lamp_color(lamp)) > 0))
