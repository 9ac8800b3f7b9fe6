"""The last bake's report, kept with the scene as JSON."""

import json
from functools import lru_cache

import bpy


def store_report(scene_name: str, report: dict) -> None:
    """Keep ``report`` in the scene; nothing happens when that scene is gone."""
    scene = bpy.data.scenes.get(scene_name)
    if scene is not None:
        scene.radiosity.report = json.dumps(report)


def load_report(scene) -> dict | None:
    """The scene's last report, or None if it has none that can be read."""
    return _parsed(scene.radiosity.report)


@lru_cache(maxsize=4)
def _parsed(text: str) -> dict | None:
    """Kept, as panels ask at every redraw and a report of a thousand objects takes a millisecond."""
    if not text:
        return None
    try:
        report = json.loads(text)
    except ValueError:
        return None  # written by hand, or by another version
    return report if isinstance(report, dict) and "seconds" in report else None


def report_text(report: dict) -> str:
    """The report as indented JSON, for the clipboard."""
    return json.dumps(report, indent=2, ensure_ascii=False)
