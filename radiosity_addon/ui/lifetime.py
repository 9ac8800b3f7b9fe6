"""What must not outlive the file it belongs to: a bake under way, and viewports that show one."""

import bpy

from . import session, view


@bpy.app.handlers.persistent
def give_up(*_) -> None:
    """Another file is about to be opened: end the bake and forget this file's viewports."""
    session.end()
    view.forget()
