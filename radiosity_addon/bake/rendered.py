"""Rendered: which objects of a view layer are rendered, for all that asks. Imports no bpy."""

from __future__ import annotations


class Rendered:
    """Whether an object is in a collection of the view layer that is rendered, by its name.

    The first are looked up one by one; who asks for more gets a set of all names made.
    """

    FEW = 8

    def __init__(self, view_layer) -> None:
        self._collections = list(_rendered(view_layer.layer_collection))
        self._asked, self._names = 0, None

    def __contains__(self, name: str) -> bool:
        self._asked += 1
        if self._asked <= self.FEW:
            return any(name in collection.objects for collection in self._collections)
        if self._names is None:
            self._names = {item.name for each in self._collections for item in each.objects}
        return name in self._names


def _rendered(collection):
    if not (collection.exclude or collection.collection.hide_render):
        yield collection.collection
        for child in collection.children:
            yield from _rendered(child)
