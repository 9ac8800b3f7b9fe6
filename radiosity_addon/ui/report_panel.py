"""The panel after a bake: the report."""

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ..figures import figure, percent
from ..report import by_reason
from . import words
from .bake_operators import noteworthy
from .lines import draw_note, pair
from .panels import RadiosityPanel
from .report_store import load_report, report_text

PHASES = {
    "export": "Reading the scene",
    "elements": "Elements",
    "transport": "Form factors",
    "solve": "Linear solve",
    "gather": "Light at the receivers",
    "write": "Writing the colors",
    "total": "Total",
}
REUSED = {
    "solution": "Solved before: only gathered anew",
    "transport": "Form factors of the last bake",
}
ENERGY = {"emitted": "Emitted", "absorbed": "Absorbed", "escaped": "Escaped"}


class RADIOSITY_PT_report(RadiosityPanel, bpy.types.Panel):
    bl_label = "Report"
    bl_parent_id = "RADIOSITY_PT_bake"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return bool(context.scene.radiosity.report)

    def draw_header_preset(self, context):
        """What is worth opening the panel for."""
        text = noteworthy(load_report(context.scene))
        if text:
            self.layout.label(text=text, icon="ERROR", translate=False)

    def draw(self, context):
        report = load_report(context.scene)
        if report is None:
            self.layout.label(text="The report cannot be read")
            return
        draw_warnings(self.layout, report)
        draw_error(self.layout, report)
        draw_work(self.layout, report)
        draw_time(self.layout, report)
        self.layout.operator("radiosity.copy_report", icon="COPYDOWN")


def draw_error(layout, report: dict) -> None:
    column = layout.column(align=True)
    pair(column, "Target Error", percent(report["target_error"]))
    pair(column, "Estimated Error", percent(report["estimated_error"]))
    if "error_95" in report:  # files that an earlier version baked have none
        within = iface_("within {}").format(percent(report["error_95"]))
        pair(column, "95 % of the Surface", within)
    energy = report["energy"]
    for name, label in ENERGY.items():
        pair(column, label, iface_("{} W").format(figure(energy[name])))


def draw_work(layout, report: dict) -> None:
    column = layout.column(align=True)
    for name, label in (
        ("triangles", "Triangles"),
        ("elements", "Elements"),
        ("receivers", "Receivers"),
        ("rays", "Rays"),
        ("iterations", "Iterations"),
    ):
        pair(column, label, words.count(report[name]))
    pair(column, "Peak Memory", words.size(report["peak_memory"]))


def draw_time(layout, report: dict) -> None:
    column = layout.column(align=True)
    for name, label in PHASES.items():
        pair(column, label, words.duration(report["seconds"][name]))
    reused = REUSED.get(report.get("reused"))
    if reused:
        column.label(text=reused, icon="FILE_REFRESH")


def draw_warnings(layout, report: dict) -> None:
    """Warnings in full, broken into lines; and the objects that were left out."""
    left_out = by_reason([item for item in report["objects"] if not item["baked"]])
    for text in (*report["warnings"], *left_out):
        draw_note(layout.column(align=True), text, "ERROR")


class RADIOSITY_OT_copy_report(bpy.types.Operator):
    """Copy the whole report to the clipboard, as JSON"""

    bl_idname = "radiosity.copy_report"
    bl_label = "Copy Report"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context):
        return bool(context.scene.radiosity.report)

    def execute(self, context):
        report = load_report(context.scene)
        if report is None:
            self.report({"ERROR"}, "The report cannot be read; bake again")
            return {"CANCELLED"}
        context.window_manager.clipboard = report_text(report)
        return {"FINISHED"}


CLASSES = (RADIOSITY_PT_report, RADIOSITY_OT_copy_report)
