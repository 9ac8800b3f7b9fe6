"""Context: one scene made ready for rays, shared by everything that traces them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from ..fields import is_black
from ..geometry.triangles import Geometry, build_geometry
from ..materials.channels import channels_of
from ..materials.evaluate import evaluate_material
from ..materials.region_means import Regions, material_means, reflectance_means
from ..progress import Progress
from ..scene import Quantity, Scene, sides, used_sides
from ..tracing.blockers import Blockers, build_blockers, trace_visible
from ..tracing.crossings import Crossings, find_crossings
from ..tracing.embree import Tracer
from ..workers.parallel import (
    Chunk_contra,
    Helpers,
    Result_co,
    Tick,
    Work,
    map_chunks,
)
from .sky import Skylight, split_sky
from .sky_spots import sky_spots
from .sources import Sources, build_sources


@dataclass
class SceneCrossings:
    """The crossings of a scene's triangles: found when somebody first asks for them, then kept."""

    geometry: Geometry
    shadow: Tracer  # of all that blocks light
    threads: int
    tick: Tick
    found: Crossings | None = None

    def get(self) -> Crossings:
        """See ``find_crossings``."""
        if self.found is None:
            self.found = find_crossings(self.geometry, self.shadow, self.threads, self.tick)
        return self.found


@dataclass(frozen=True)
class Context:
    """Light inside is divided by ``unit``, so that float32 holds scenes of any brightness."""

    scene: Scene
    geometry: Geometry
    tracer: Tracer  # what diffuse rays meet
    blockers: tuple[Blockers, ...]  # of shadow rays; the first are all that block light at all
    transmits: np.ndarray  # (n_triangles,) bool
    sources: Sources  # lights that are sampled explicitly
    explicit: np.ndarray  # (n_triangles,) bool: emission is sampled, so rays must not count it
    sky: Skylight | None
    unit: float
    channels: int  # of all light and reflectances: 1 where nothing is colored, else 3
    seed: int
    threads: int
    progress: Progress
    scene_crossings: SceneCrossings  # one for all contexts of this scene
    helpers: Helpers | None = None  # that know this context, too

    @cached_property
    def glows(self) -> bool:
        """Some surface may emit light that is not sampled explicitly."""
        met = used_sides(self.scene, ~self.explicit)
        return not all(is_black(side.emission) for side in met)

    @property
    def rays(self) -> int:
        """Traced so far."""
        mine = sum(tracer.rays for tracer in self._distinct())
        return mine if self.helpers is None else mine + self.helpers.rays

    @property
    def embree_seconds(self) -> float:
        """Spent inside Embree so far, summed over threads and processes."""
        mine = sum(tracer.seconds for tracer in self._distinct())
        return mine if self.helpers is None else mine + self.helpers.embree_seconds

    @property
    def crossings(self) -> Crossings:
        """Where triangles are cut by others that block light."""
        return self.scene_crossings.get()

    def under(self, sources: Sources) -> Context:
        """The same scene under other lights."""
        return replace(self, sources=sources)

    @property
    def all_rays_alike(self) -> bool:
        """Every object is met by diffuse rays and by shadow rays."""
        return all(met is None or met.all() for met in (self.scene.casts_shadow, self.scene.visible))

    def _distinct(self) -> list[Tracer]:
        tracers = [self.tracer, *(t for b in self.blockers for t in (b.shadow, b.transmitting) if t)]
        return list({id(tracer): tracer for tracer in tracers}.values())

    def tick(self, phase: str) -> Tick:
        """A function of the fraction done that reports it for ``phase``."""
        return partial(self.progress, phase)

    def map_chunks(
        self, work: Work[Chunk_contra, Result_co], chunks: Iterable[Chunk_contra], phase: str
    ) -> list[Result_co]:
        """``[work(chunk) for chunk in chunks]``, on all cores, with progress of ``phase``. The work is
        data: it can be pickled, with contexts of this scene in it."""
        return map_chunks(work, chunks, self.threads, self.tick(phase), self.helpers)

    def reflectance(
        self, triangle: np.ndarray, uv: np.ndarray, front: np.ndarray | None = None
    ) -> np.ndarray:
        """(n, channels) float64 at barycentric uv (n, 2) of triangles (n,), of the side that
        ``front`` (n,) bool tells; None: of the fronts."""
        return np.clip(self._evaluate("reflectance", triangle, uv, front), 0, 1)

    def transmittance(self, triangle: np.ndarray, uv: np.ndarray, front: np.ndarray) -> np.ndarray:
        """(n, channels) float64 at barycentric uv (n, 2) of triangles (n,) for light that arrives
        where they are seen from the side that ``front`` (n,) bool tells."""
        return np.clip(self._evaluate("transmittance", triangle, uv, front), 0, 1)

    def emission(
        self, triangle: np.ndarray, uv: np.ndarray, front: np.ndarray | None = None
    ) -> np.ndarray:
        """(n, channels) float64 radiance in the context's unit, of the side that ``front`` (n,)
        bool tells; None: of the fronts."""
        return np.maximum(self._evaluate("emission", triangle, uv, front), 0) / self.unit

    def mean_emission(self, regions: Regions, front: bool = True) -> tuple[np.ndarray, np.ndarray]:
        """(n, channels) float64 exact mean radiance over regions, in the context's unit, and its
        deviation (n,) in there."""
        mean, deviation = material_means(self.scene, "emission", regions, front)
        return mean[:, : self.channels] / self.unit, deviation / self.unit

    def mean_reflectances(self, regions: Regions) -> np.ndarray:
        """(n, 2 · channels) float64 exact means of the reflectance, and of the diffuse one behind it, over
        regions of fronts."""
        diffuse, _ = material_means(self.scene, "diffuse_reflectance", regions)
        both = reflectance_means(self.scene, regions, diffuse), diffuse
        return np.clip(np.concatenate([mean[:, : self.channels] for mean in both], axis=1), 0, 1)

    def _evaluate(
        self, quantity: Quantity, triangle: np.ndarray, uv: np.ndarray, front: np.ndarray | None = None
    ) -> np.ndarray:
        found = evaluate_material(self.scene, quantity, triangle, uv, front)
        return found[:, : self.channels]


def build_context(
    scene: Scene, seed: int, threads: int, progress: Progress, channels: int | None = None,
    helpers: Helpers | None = None,
) -> Context:
    """Normalize the scene, build Embree's tree, list the lights. ``channels``: 3, or None for as few as the
    scene's colors need. ``helpers`` do some of what is asked of ``Context.map_chunks``.

    Raises ValueError where vertices are not finite or indices out of range.
    """
    geometry = build_geometry(scene.vertices, scene.triangles)
    tracer, transmits = trace_visible(scene, geometry), _transmitting(scene)
    sky, spots = None, None
    if scene.sky is not None and np.any(scene.sky.pixels > 0):
        pixels, found = split_sky(scene.sky)
        spots = sky_spots(pixels.shape[:2], found)
        sky = Skylight(pixels)
    sources, explicit = build_sources(scene, geometry, tracer, spots)
    blockers = build_blockers(scene, geometry, transmits, tracer, sources.blocking)
    unit, channels = _brightest(scene, sources, sky), channels or channels_of(scene)
    sources = sources.scaled(1 / unit).narrowed(channels)
    if sky is not None:
        sky = Skylight((np.pi / unit * sky.pixels[..., :channels]).astype(np.float32))
    shadow, tick = blockers[0].shadow, partial(progress, "elements")
    crossings = SceneCrossings(geometry, shadow, threads, tick)
    return Context(
        scene, geometry, tracer, blockers, transmits, sources, explicit, sky, unit, channels, seed,
        threads, progress, crossings, helpers,
    )


def _transmitting(scene: Scene) -> np.ndarray:
    """(n_triangles,) bool: triangles that let light through on one side at least."""
    clear = np.array(
        [not all(is_black(side.transmittance) for side in sides((m,))) for m in scene.materials],
        bool,
    )
    return clear[scene.material] if len(scene.triangles) else np.zeros(0, bool)


def _brightest(scene: Scene, sources: Sources, sky: Skylight | None) -> float:
    """A brightness to divide by: the largest color of any source; 1 where nothing shines."""
    count = len(scene.triangles)
    middle = np.full((count, 2), 1 / 3)
    peaks = [sources.brightest()]
    for front in (True, False):
        side = np.full(count, front)
        emission = evaluate_material(scene, "emission", np.arange(count), middle, side)
        peaks += [float(emission.max())] if emission.size else []
    peaks += [float(sky.pixels.max())] if sky is not None else []
    return max(peaks, default=0.0) or 1.0
