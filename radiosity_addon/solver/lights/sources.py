"""Sources: which of a scene's lights are sampled explicitly, gathered into kinds."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..geometry.triangles import Geometry
from ..scene import Lamp, PointLamp, Scene, SunLamp, lamp_color
from ..tracing.embree import Tracer
from .distributions import make_distributions
from .emissive_faces import emissive_faces
from .facing_disks import FacingDisks
from .flat_shapes import ELLIPSE, RECTANGLE
from .light_batch import LightBatch
from .light_range import useful_lights
from .light_sampler import FEW, LightSampler, make_light_sampler
from .light_tree import join_emitters
from .polygons import Polygons, join_polygons
from .sky_spots import SkySpots
from .spheres import SphereLights
from .suns import Suns


@dataclass(frozen=True)
class Sources:
    """All explicit lights, numbered through their kinds."""

    batches: tuple[LightBatch, ...]  # Polygons, FacingDisks, SphereLights, Suns, SkySpots
    batch: np.ndarray  # (n,) int: which kind a light belongs to
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
        emitters, samplers = join_emitters([batch.emitters() for batch in self.batches]), []
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


def build_sources(
    scene: Scene, geometry: Geometry, tracer: Tracer, spots: SkySpots | None
) -> tuple[Sources, np.ndarray]:
    """Every light to sample, and (n_triangles,) bool: whose emission that covers."""
    faces, explicit = emissive_faces(scene, geometry, tracer)
    rows = {Polygons: [], FacingDisks: [], SphereLights: [], Suns: [], SkySpots: []}
    linked, shaped = {batch: [] for batch in rows}, {batch: [] for batch in rows}
    glow = _pairs(scene.emission_objects, scene.emission_blockers, len(scene.objects))
    linked[Polygons] = [glow[owner] for owner in faces.object]
    pairs = _pairs(scene.lamp_objects, scene.lamp_blockers, len(scene.lamps))
    for lamp, pair in zip(scene.lamps, pairs):
        if _shines(lamp):
            batch, row = _lamp_row(lamp, geometry)
            rows[batch].append(row)
            linked[batch].append(pair)
            shaped[batch].append(getattr(lamp, "distribution", None))
    made = _batches(rows, shaped, faces, spots)
    if spots is not None:
        linked[SkySpots] = [(None, None)] * len(spots.color)
    present = [batch for batch in rows if batch in made]
    batches = tuple(made[batch] for batch in present)
    sizes = [len(batch.color) for batch in batches]
    batch = np.repeat(np.arange(len(present)), sizes)
    index = np.concatenate([np.arange(size) for size in sizes] or [np.zeros(0, int)])
    pairs = [pair for batch in present for pair in linked[batch]]
    (link, allowed), (block, blocking) = (
        _links([pair[i] for pair in pairs], len(scene.objects)) for i in (0, 1)
    )
    useful = useful_lights(batches, tuple(pair[0] for pair in pairs), scene, geometry)
    always, samplers = _samplers(batches, batch, useful, block)
    allowed = allowed if len(allowed) > 1 else None
    sources = Sources(batches, batch, index, link, allowed, block, blocking, always, samplers)
    return sources, explicit


def _batches(
    rows: dict[type, list], shaped: dict[type, list], faces: Polygons, spots: SkySpots | None
) -> dict[type, LightBatch]:
    """Batches of the lamps' ``rows``, of which those of some kinds are ``shaped`` by distributions,
    of emissive ``faces``, and of the sky's bright ``spots``."""
    made = {
        batch: batch(*(np.array(column) for column in zip(*mine)))
        for batch, mine in rows.items() if mine
    }  # fmt: skip
    for batch in (FacingDisks, SphereLights):
        if batch in made:
            shapes = make_distributions(shaped[batch])
            made[batch] = replace(made[batch], shapes=shapes)
    if len(faces.color):
        made[Polygons] = join_polygons([faces, made[Polygons]]) if Polygons in made else faces
    if spots is not None:
        made[SkySpots] = spots
    return made


def _pairs(lit: tuple | None, shading: tuple | None, count: int) -> list[tuple]:
    """For each of ``count`` lights the objects it lights, and those that shade it; None: all."""
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


def _samplers(batches: tuple[LightBatch, ...], batch: np.ndarray, useful: np.ndarray, block: np.ndarray):
    """Near and distant lights, apart: those sampled everywhere, and samplers to choose others from.
    Only those that are ``useful`` (n,) bool take part; those of different rows ``block`` (n,) are
    apart, too, so that a choice's shadow rays all meet the same objects."""
    always, samplers = [], []
    for row in np.unique(block[useful]):
        for distant in (False, True):
            mine = [k for k, lights in enumerate(batches) if isinstance(lights, Suns) == distant]
            every = np.flatnonzero(np.isin(batch, mine))
            some = useful[every] & (block[every] == row)
            lights = every[some]
            if len(lights) <= FEW:
                always += lights.tolist()
            else:
                emitters = join_emitters([batches[k].emitters() for k in mine])
                samplers.append(make_light_sampler(lights, emitters.take(some), int(row)))
    return tuple(always), tuple(samplers)


def _shines(lamp: Lamp) -> bool:
    return bool(np.any(np.asarray(lamp_color(lamp)) > 0))


def _lamp_row(lamp: Lamp, geometry: Geometry):
    """The kind of a lamp and its row in there, in normalized lengths."""
    if isinstance(lamp, SunLamp):
        toward = -np.asarray(lamp.direction, float)
        toward = toward / np.linalg.norm(toward)
        return Suns, (np.asarray(lamp.irradiance, float), toward, np.tan(lamp.angle / 2))
    if isinstance(lamp, PointLamp):
        spot = lamp.axis is not None
        edge = np.cos(min(lamp.cone, 2 * np.pi) / 2) if spot else -2.0
        return SphereLights if lamp.ball and lamp.radius > 0 else FacingDisks, (
            np.asarray(lamp.intensity, float) / geometry.scale**2,
            geometry.normalized(lamp.position),
            lamp.radius / geometry.scale,
            np.asarray(lamp.axis if spot else (0, 0, -1), float),
            edge,
            (1 - edge) * lamp.blend if spot else 1.0,
        )
    u, v = np.asarray(lamp.u, float) / geometry.scale, np.asarray(lamp.v, float) / geometry.scale
    return Polygons, (
        np.asarray(lamp.radiance, float),
        ELLIPSE if lamp.ellipse else RECTANGLE,
        geometry.normalized(lamp.center) - (u + v) / 2,
        u,
        v,
        np.asarray(lamp.normal, float),
        False,
        min(lamp.spread, np.pi),
        1.0,
        0.0,
        -1,
        np.zeros((3, 2)),
        -1,
    )
