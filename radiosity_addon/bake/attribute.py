"""The color attribute on the user's mesh."""

from __future__ import annotations

import numpy as np

from ..settings import LONGEST_NAME, Domain, check_name
from ..solver.expected import Refused
from .bake_notes import COLOR, note
from .layers import check_editable, item_count, write_attribute

FALLBACK = "{} Color"  # where something that is no color attribute holds the name already


def write_colors(
    item, name: str, colors: np.ndarray, domain: str, data_type: str = "FLOAT_COLOR"
) -> list[str]:
    """Write linear ``colors`` (n_loops or n_vertices, 3) as an attribute of type ``data_type``, alpha 1.

    ``domain`` is "corner" or "point"; with "point", vertices past the last row belong to no face
    and become black. An attribute of that name, type and domain is overwritten, a color
    attribute of another type or domain replaced. A new attribute becomes the active one; the one
    that renders stays the user's, if there is any. Returns warnings. Raises Refused for a
    linked mesh, a name too long, and rows that do not fit the mesh.
    """
    mesh = item.data
    check_editable(item.name, mesh)
    name, warnings = _free_name(item, name)
    rows = _rows(mesh, colors, domain)
    existing = mesh.color_attributes.get(name)
    wanted = (data_type, domain.upper())
    if existing is None or (existing.data_type, existing.domain) != wanted:
        if existing is not None:
            warnings.append(
                f"{item.name!r}: its color attribute {name!r} was {existing.data_type} per "
                f"{existing.domain.lower()} and is now {data_type} per {domain}"
            )
        _make(mesh, name, existing, wanted)
        if existing is None:
            note(mesh, name, kind=COLOR, new=True)
    write_attribute(mesh, name, rows)
    return warnings


def find_colors(mesh, name: str) -> str | None:
    """What ``write_colors`` called the color attribute ``name`` on this mesh; None without."""
    layers = mesh.color_attributes
    for candidate in (name, FALLBACK.format(name)):
        if candidate in layers:
            return candidate
    return None


def _rows(mesh, colors: np.ndarray, domain: str) -> np.ndarray:
    """(n, 4) float32 for every loop or vertex of the mesh; Refused when they do not fit."""
    size = item_count(mesh, domain)
    short_allowed = domain == Domain.POINT and len(colors) <= size
    if len(colors) != size and not short_allowed:
        raise Refused(
            f"mesh {mesh.name!r} has {size} {domain}s where {len(colors)} were baked; it changed: "
            "bake again"
        )
    rows = np.zeros((size, 4), np.float32)
    rows[: len(colors), :3] = colors
    rows[:, 3] = 1.0
    return rows


def _free_name(item, name: str) -> tuple[str, list[str]]:
    """The name to use: attributes of a mesh, UV maps among them, share one set of names."""
    check_name(name)
    mesh = item.data
    if name not in mesh.attributes or mesh.color_attributes.get(name) is not None:
        return name, []
    other = FALLBACK.format(name)
    if len(other.encode()) > LONGEST_NAME or (
        other in mesh.attributes and mesh.color_attributes.get(other) is None
    ):
        raise Refused(
            f"{item.name!r} has an attribute or UV map {name!r} already; choose another --name"
        )
    return other, [f"{item.name!r}: {name!r} is a UV map or attribute of another kind there; the "
                   f"colors are in {other!r}"]


def _make(mesh, name: str, existing, wanted) -> None:
    """A new attribute in place of ``existing``; active, and rendered where none or it was."""
    layers = mesh.color_attributes
    rendered = layers[layers.render_color_index].name if len(layers) else name
    if existing is not None:
        layers.remove(existing)
    data_type, domain = wanted
    layers.new(name=name, type=data_type, domain=domain)
    layers.active_color = layers[name]
    layers.render_color_index = layers.find(rendered)
