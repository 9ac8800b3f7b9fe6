"""What must not outlive the file it belongs to: a bake, what it kept, viewports that show one."""

import bpy

from . import overlay, preflight, results, session, view


@bpy.app.handlers.persistent
def give_up(*_) -> None:
    """Another file is about to be opened: end the bake and forget what is this file's."""
    session.forget()
    view.forget()


@bpy.app.handlers.persistent
def before_undo(*_) -> None:
    """All of Blender's data are about to be replaced."""
    session.undone()


HANDLERS = (
    ("load_pre", give_up),
    ("undo_pre", before_undo),
    ("redo_pre", before_undo),
    ("depsgraph_update_post", preflight.outdate),
    ("depsgraph_update_post", results.look_again),
    ("depsgraph_update_post", overlay.follow),
    ("frame_change_post", overlay.follow),
    ("undo_post", overlay.outdate),
    ("redo_post", overlay.outdate),
    ("load_post", preflight.outdate),
    ("undo_post", preflight.outdate),
    ("redo_post", preflight.outdate),
)
