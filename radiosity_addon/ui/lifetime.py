"""What must not outlive the file it belongs to: a bake, what it kept, viewports that show one."""

import bpy

from . import session, view


@bpy.app.handlers.persistent
def give_up(*_) -> None:
    """Another file is about to be opened: end the bake and forget what is this file's."""
    session.forget()
    view.forget()
