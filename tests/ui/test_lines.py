"""Texts in the panel fit the sidebar."""

from __future__ import annotations

from types import SimpleNamespace

import pytest


@pytest.mark.parametrize(("width", "scale", "expected"), [(280, 1.0, 36), (640, 1.0, 100), (640, 2.0, 42)])
def test_notes_are_as_wide_as_the_sidebar(addon, width, scale, expected):
    """(pixels / scale - 80) / 5.6 characters, at least the 36 of a sidebar as Blender opens it."""
    from radiosity_addon.ui.lines import broken, line_length

    system = SimpleNamespace(ui_scale=scale)
    context = SimpleNamespace(
        region=SimpleNamespace(width=width), preferences=SimpleNamespace(system=system)
    )
    assert line_length(context) == expected
    text = "Leave the current mode for Object Mode first"
    assert " ".join(broken(text, expected)) == text
    assert max(map(len, broken(text, expected))) <= expected
