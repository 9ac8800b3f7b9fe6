"""Export: from a Blender scene to the solver's Scene, leaving the file as it was.

``export_scene`` is the way in.
"""

from __future__ import annotations

from ..bake.exported_object import ExportedObject
from ..steps import finish
from .exported import Exported

__all__ = ["Exported", "ExportedObject", "export_scene"]


def export_scene(context, settings, progress=None) -> Exported:
    """Read the context's scene and view layer as a render sees them.

    ``progress(fraction)`` is called now and then and may raise to cancel. Raises Refused for
    objects or UV maps that are not there, or when no mesh is left to bake.
    """
    from .pipeline import steps

    progress = progress or (lambda fraction: None)
    return finish(steps(context.scene, context.view_layer, settings, progress), progress)
