"""Fixtures of the export's tests."""

from __future__ import annotations

import pytest

from radiosity_addon.settings import Settings


@pytest.fixture
def export(blender):
    """export(target="vertex", ...) of the current file with these settings."""
    from radiosity_addon.export import export_scene

    return lambda **settings: export_scene(blender.context, Settings(**settings))
