"""A second bake over the first: other target, same names."""

from __future__ import annotations

import pytest


@pytest.fixture
def file(addon, room):
    addon.ops.wm.open_mainfile(filepath=str(room))
    addon.context.scene.radiosity.quality = "DRAFT"
    addon.context.scene.radiosity.resolution = 16
    return addon


@pytest.mark.parametrize("order", [("VERTEX", "IMAGE"), ("IMAGE", "VERTEX")])
def test_both_targets_in_one_file_with_the_default_names(file, order):
    """Attributes and UV maps of a mesh share one set of names, so the second gets another."""
    from radiosity_addon.ui.results import has_result

    properties = file.context.scene.radiosity
    for target in order:
        properties.target = target
        assert file.ops.radiosity.bake() == {"FINISHED"}
    for target in order:
        properties.target = target
        assert has_result(file.data.objects["Box"], properties)


def test_baking_twice_changes_nothing_but_the_report(file):
    colors = []
    for _ in range(2):
        file.ops.radiosity.bake()
        layers = file.data.objects["Box"].data.color_attributes
        assert len(layers) == 1
        colors.append([tuple(item.color) for item in layers[0].data])
    assert colors[0] == colors[1]
