"""Joint fits: what turns light into the colors of meshes, those that touch together. No bpy.

Corners of objects that are one place of one surface are one unknown, so that such objects are
fitted as if they were one mesh.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..bake.corner_fit import CornerFit, JoinedUnknowns, corner_fit, unknowns_of
from ..bake.exported_object import CornerMap, ExportedObject
from ..bake.faces import receiver_areas
from ..bake.hanging import Hanging
from ..bake.pieces import joined_unknowns
from ..bake.shared_colors import shared_warning
from ..components import connected_components
from ..settings import Domain
from ..solver.direct.line_of_sight import are_free
from ..solver.fields import Constant
from ..solver.lights.context import Context
from ..solver.receivers import concatenate
from ..solver.scene import Material, Scene
from .job import Job
from .layout import Layout

ALONE = 0.999  # weight [of 1]: a corner whose color is that of one loop has so much of it


@dataclass(frozen=True)
class JointFit:
    """The fit of several targets' colors."""

    fit: CornerFit
    targets: tuple[int, ...]
    spans: tuple[slice, ...]  # of their receivers
    ends: tuple[int, ...]  # where the colors of each begin, and of the last end

    def light(self, values: np.ndarray) -> np.ndarray:
        """Of all receivers' ``values`` (count, c) those of these targets' k receivers, (k, c)."""
        return np.concatenate([values[span] for span in self.spans])

    def put(self, values: np.ndarray, everywhere: np.ndarray) -> None:
        """The opposite of ``light``: ``values`` (k,) of these targets' receivers into those of all, (count,)."""
        parts = np.split(values, np.cumsum([span.stop - span.start for span in self.spans])[:-1])
        for span, part in zip(self.spans, parts):
            everywhere[span] = part

    def colors(self, values: np.ndarray) -> list[np.ndarray]:
        """Colors (n, 3) float64 of each target, for light ``values`` (count, 3) at all receivers."""
        return np.split(self.fit.colors(self.light(values)), self.ends[1:-1])


def joint_fits(job: Job, layout: Layout, context: Context, seen: np.ndarray) -> list[JointFit]:
    """The fits of all targets. ``seen`` (count,): how much of receivers is seen for their area."""
    unknowns = _unknowns(job, context)
    return [_fit(job, layout, seen, members.tolist(), unknowns) for members in _clusters(unknowns)]


def shared_color_warnings(job: Job, layout: Layout, light: np.ndarray) -> list[str]:
    """Warnings of colors that modifiers repeat where the ``light`` (count, 3) at all receivers is another."""
    scene, warnings = job.scene, []
    for index, target in enumerate(job.targets):
        if not target.modifiers:
            continue
        own = slice(*layout.spans[index : index + 2])
        points = scene.vertices[scene.triangles[target.start : target.stop]]
        unknown = unknowns_of(target, job.settings.domain)
        warnings.append(shared_warning(target, unknown, layout.part(index), light[own], points))
    return list(filter(None, warnings))


@dataclass(frozen=True)
class _Unknowns:
    """The unknown colors of all targets. ``label`` (m,) int: unknowns of one label are one. ``start`` (targets + 1,)
    int: where those of each target begin. Hanging labels lie on lines between others."""

    label: np.ndarray
    start: np.ndarray
    hanging: Hanging


def _unknowns(job: Job, context: Context) -> _Unknowns:
    """Those of all targets, joined where they are one place of one surface. Raises ValueError for
    targets that were exported for images."""
    for target in job.targets:
        if target.corner_map is None or target.loop_vertex is None:
            raise ValueError(f"{target.name!r} was exported without its loops; export for vertices")
    scene = job.scene
    owned = np.concatenate([np.arange(target.start, target.stop) for target in job.targets])
    unknown, start = _at_corners(job.targets, job.settings.domain)
    group, _ = _at_corners(job.targets, Domain.CORNER)
    label, hanging = joined_unknowns(
        scene.vertices, scene.triangles[owned], unknown, int(start[-1]),
        _materials(scene)[scene.material[owned]], lambda segments: are_free(context, segments), group,
    )  # fmt: skip
    return _Unknowns(label, start, hanging)


def _at_corners(targets, domain: str) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) int: of which unknown, of all targets', each triangle corner has its color; -1 where it mixes several.
    And where each target's unknowns begin."""
    unknown, start = [], [0]
    for target in targets:
        own, corners = unknowns_of(target, domain), target.corner_map
        alone = np.flatnonzero(corners.weights > ALONE)
        found = np.full(len(corners.start) - 1, -1)
        row = np.searchsorted(corners.start, alone, "right") - 1
        found[row] = start[-1] + own[corners.loops[alone]]
        unknown.append(found.reshape(-1, 3))
        start.append(start[-1] + int(own.max(initial=-1)) + 1)
    return np.concatenate(unknown), np.array(start)


def _materials(scene: Scene) -> np.ndarray:
    """(n_materials,) int numbers of materials; materials of equal values have one number."""
    seen: dict[object, int] = {}
    return np.array([
        seen.setdefault(_look(material, index), len(seen))
        for index, material in enumerate(scene.materials)
    ], int)  # fmt: skip


def _look(material: Material, index: int) -> object:
    fields = material.diffuse_reflectance, material.emission
    if all(isinstance(field, Constant) for field in fields):
        return tuple(tuple(np.asarray(field.value, float).tolist()) for field in fields)
    return index


def _clusters(unknowns: _Unknowns) -> list[np.ndarray]:
    """Groups of targets (k,) int that have unknowns in common, or unknowns that hang on one another, group by group.
    """
    label, hanging, count = unknowns.label, unknowns.hanging, len(unknowns.start) - 1
    owner = np.repeat(np.arange(count), np.diff(unknowns.start))
    first = np.full(len(label), count)
    np.minimum.at(first, label, owner)
    one = first[np.concatenate([label, hanging.corner, hanging.corner])]
    other = np.concatenate([owner, first[hanging.start], first[hanging.end]])
    cluster = connected_components(count, one, other)
    order = np.argsort(cluster, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(cluster[order])) + 1)


def _fit(
    job: Job, layout: Layout, seen: np.ndarray, members: list[int], unknowns: _Unknowns
) -> JointFit:
    """The fit of the targets ``members``, as if they were one mesh. ``seen`` (count,): how much of receivers is seen for
    their area."""
    own, parts = [job.targets[i] for i in members], [layout.part(i) for i in members]
    first = np.cumsum([0] + [target.stop - target.start for target in own])
    areas = [receiver_areas(job.scene.vertices, job.scene.triangles, part) for part in parts]
    moved = [
        replace(part, triangle=part.triangle - np.int32(target.start - at), shading=None)
        for target, part, at in zip(own, parts, first)
    ]
    hidden = np.concatenate([_hidden_faces(layout, each.start, each.stop) for each in own])
    spans = tuple(slice(*layout.spans[i : i + 2]) for i in members)
    fit = corner_fit(
        _as_one(own), concatenate(moved), np.concatenate(areas), job.settings.domain, hidden,
        _of_members(unknowns, members), np.concatenate([seen[span] for span in spans]),
    )  # fmt: skip
    point = job.settings.domain == Domain.POINT
    sizes = [_vertices(each) if point else len(each.loop_vertex) for each in own]
    return JointFit(fit, tuple(members), spans, tuple(np.cumsum([0, *sizes]).tolist()))


def _of_members(unknowns: _Unknowns, members: list[int]) -> JoinedUnknowns:
    """Those of the ``members``."""
    start, number = unknowns.start, np.full(len(unknowns.label), -1)
    own = np.concatenate([unknowns.label[start[i] : start[i + 1]] for i in members])
    used, joined = np.unique(own, return_inverse=True)
    number[used] = np.arange(len(used))
    hanging = unknowns.hanging.take(number[unknowns.hanging.corner] >= 0)
    return JoinedUnknowns(joined.reshape(-1), hanging.renamed(number))


def _as_one(targets: list[ExportedObject]) -> ExportedObject:
    """Several targets as one mesh, with triangles, loops and vertices one after the other."""
    size, loops, vertex, group = [], [], [], []
    at = np.zeros(3, int)  # loops, vertices and groups so far
    for target in targets:
        size.append(np.diff(target.corner_map.start))
        loops.append(target.corner_map.loops + at[0])
        vertex.append(target.loop_vertex + at[1])
        group.append(target.loop_smooth_group + at[2])
        groups = int(target.loop_smooth_group.max(initial=-1)) + 1
        at += len(target.loop_vertex), _vertices(target), groups
    start = np.concatenate([[0], np.cumsum(np.concatenate(size))])
    weights = np.concatenate([target.corner_map.weights for target in targets])
    corner_map = CornerMap(start, np.concatenate(loops), weights, int(at[0]))
    name = targets[0].name + (f" and {len(targets) - 1} more" if len(targets) > 1 else "")
    triangles = sum(target.stop - target.start for target in targets)
    return ExportedObject(
        name, 0, triangles, None, corner_map, np.concatenate(vertex), np.concatenate(group)
    )


def _vertices(target: ExportedObject) -> int:
    return int(target.loop_vertex.max(initial=-1)) + 1


def _hidden_faces(layout: Layout, start: int, stop: int) -> np.ndarray:
    """(n,) bool: triangles from ``start`` to ``stop`` whose receivers are all buried."""
    buried, shown = (
        np.isin(np.arange(start, stop), [] if some is None else some.triangle)
        for some in (layout.buried, layout.receivers)
    )
    return buried & ~shown
