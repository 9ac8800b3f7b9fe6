"""The operators that bake and that cancel. They orchestrate; the work is done elsewhere."""

from functools import partial

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ..files import check_folder
from ..solver.expected import EXPECTED  # anything else is a fault of ours and shows its traceback
from . import background, overlay, results, session
from .choice import chosen_objects, why_not
from .keywords import given_to, with_keywords, without_use
from .progress_bar import redraw
from .properties import settings_of
from .report_store import store_report
from .words import by_labels

CANCELED = "Bake canceled; the scene is as it was"
FAULT = "This is a fault of Radiosity, not of the scene; please report it"


class RADIOSITY_OT_bake(bpy.types.Operator):
    """Solve the light of the scene and bake it onto the objects. Esc cancels"""

    # Invoked, it starts a bake, which a timer carries on; that invokes it again to write what was
    # solved. So it runs modally for that short time only: Blender saves no file by itself
    # (auto-save) while an operator runs.
    bl_idname = "radiosity.bake"
    bl_label = "Bake Radiosity"
    bl_options = {"REGISTER", "UNDO"}

    _timer = None

    @classmethod
    def poll(cls, context):
        bake = session.current()
        reason = "" if bake is not None and bake.wants_operator else why_not(context)
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def invoke(self, context, event):
        """Start the bake in the background, or write what it has solved; come back at once."""
        if bpy.app.background:
            return self.execute(context)
        if session.current() is not None:
            return self._go_modal(context)
        if not self._begin(context):
            return {"CANCELLED"}
        background.carry_on(context.window, given_to(self))
        redraw(context)
        return {"INTERFACE"}

    def modal(self, context, event):
        bake = session.current()
        if bake is None:  # canceled by its button, or the file was closed
            return self._finish(context, {"CANCELLED"})
        if event.type == "ESC" and event.value == "PRESS":
            self.report({"INFO"}, rpt_(CANCELED))
            return self._finish(context, {"CANCELLED"})
        if event.type != "TIMER":  # nothing else may change what is being written
            return {"RUNNING_MODAL"}
        return self._tick(context, bake)

    def execute(self, context):
        """Bake and return when it is done: for scripts and background mode."""
        if not bpy.app.background and (self.options.is_repeat or self.options.is_repeat_last):
            return self._again()
        if not self._begin(context):
            return {"CANCELLED"}
        bake = session.current()
        while bake.state is not session.State.DONE:
            if not self._step(context, bake):
                return {"CANCELLED"}
            bake.wait(1.0)
            if bake.state is session.State.WAIT:
                session.end()
                self.report({"ERROR"}, rpt_("Leave Edit Mode first"))
                return {"CANCELLED"}
        return self._done(context, bake)

    def cancel(self, context):
        """Blender ends the operator: its window or the file is being closed."""
        self._finish(context, {"CANCELLED"})

    def _again(self):
        """Repeat Last and Adjust Last Operation: what the button does, once this call is over, as
        a call that blocks would freeze the window."""
        window = bpy.context.window
        press = partial(background.press, window and window.as_pointer(), given_to(self))
        bpy.app.timers.register(press, first_interval=0.0)
        return {"CANCELLED"}

    def _go_modal(self, context):
        manager = context.window_manager
        self._progress = background.Progress()
        self._timer = manager.event_timer_add(background.AT_WORK, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def _begin(self, context) -> bool:
        try:
            properties = with_keywords(context.scene.radiosity, self)
            settings = settings_of(properties, chosen_objects(context, properties))
            if settings.image_dir:  # else a bake of hours would end with that
                check_folder(settings.image_dir, rpt_("Image Files"))
            session.begin(session.BakeSession(context.scene.name, settings))
            self._tell_unused(properties.target)
        except EXPECTED as error:
            self.report({"ERROR"}, by_labels(str(error)))
            return False
        return True

    def _tell_unused(self, target: str) -> None:
        unused = ", ".join(without_use(target, self))
        if unused:
            self.report({"WARNING"}, rpt_("The target {:s} has no use for: {:s}").format(target, unused))

    def _tick(self, context, bake):
        if not self._step(context, bake):
            return self._finish(context, {"CANCELLED"})
        self._progress.show(context, bake)
        if bake.state is session.State.DONE:
            return self._finish(context, self._done(context, bake))
        return {"RUNNING_MODAL"}

    def _step(self, context, bake) -> bool:
        """One step of the bake; False after a failure, of this or of the timer's last step, which
        has been reported."""
        try:
            if bake.failure is not None:
                raise bake.failure
            bake.step(context)
        except EXPECTED as error:
            self.report({"ERROR"}, by_labels(str(error)) or type(error).__name__)
            session.end()
            return False
        except BaseException as error:  # Blender shows its traceback, and asks nothing of us any more
            error.add_note(FAULT)
            self._finish(context, {"CANCELLED"})
            raise
        return True

    def _done(self, context, bake):
        store_report(bake.scene_name, bake.report)
        session.end()
        overlay.outdate()
        results.look_again()
        for warning in bake.report["warnings"]:
            self.report({"WARNING"}, by_labels(warning))
        self.report({"WARNING" if noteworthy(bake.report) else "INFO"}, summary(bake.report))
        return {"FINISHED"}

    def _finish(self, context, status):
        session.end()
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
        redraw(context)
        return status


def summary(report: dict) -> str:
    """``Baked 7 objects, 2 warnings``."""
    baked = sum(item["baked"] for item in report["objects"])
    text = rpt_("Baked 1 object") if baked == 1 else rpt_("Baked {:d} objects").format(baked)
    return ", ".join(filter(None, [text, noteworthy(report)]))


def noteworthy(report: dict | None) -> str:
    """``1 left out, 2 warnings``; empty without any."""
    if report is None:
        return ""
    left_out = sum(not item["baked"] for item in report["objects"])
    warnings, parts = len(report["warnings"]), []
    if left_out:
        parts.append(rpt_("{:d} left out").format(left_out))
    if warnings:
        parts.append(rpt_("1 warning") if warnings == 1 else rpt_("{:d} warnings").format(warnings))
    return ", ".join(parts)


class RADIOSITY_OT_cancel(bpy.types.Operator):
    """Stop the bake that is running; the scene stays as it was"""

    bl_idname = "radiosity.cancel"
    bl_label = "Cancel Bake"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context):
        return session.current() is not None

    def execute(self, context):
        session.end()
        self.report({"INFO"}, rpt_(CANCELED))
        redraw(context)
        return {"FINISHED"}


CLASSES = (RADIOSITY_OT_bake, RADIOSITY_OT_cancel)
