"""Rendered: which objects of a view layer the collections let renders show. No imports."""

from __future__ import annotations


def rendered_names(collection) -> set[str]:
    """Names of the objects in a layer collection and below it, without those that are excluded or
    disabled in renders."""
    if collection.exclude or collection.collection.hide_render:
        return set()
    names = {item.name for item in collection.collection.objects}
    return names.union(*map(rendered_names, collection.children))
