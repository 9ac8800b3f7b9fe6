"""Presets of the panel's settings: named files that people save, share and choose from a menu."""

from pathlib import Path

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from .properties import RadiositySettings

FOLDER = "radiosity"
SHIPPED = str(Path(__file__).resolve().parents[1])  # holds presets/radiosity/
NOT_IN_PRESETS = ("report", "image_dir", "objects_from")  # of one file, not of a kind


class RADIOSITY_PT_presets(PresetPanel, bpy.types.Panel):
    bl_label = "Radiosity Presets"
    preset_subdir = FOLDER
    preset_operator = "script.execute_preset"
    preset_add_operator = "radiosity.preset_add"


class RADIOSITY_OT_preset_add(AddPresetBase, bpy.types.Operator):
    """Save the settings of this panel under a name, or remove a saved one"""

    bl_idname = "radiosity.preset_add"
    bl_label = "Add Radiosity Preset"
    bl_options = {"REGISTER", "INTERNAL"}
    preset_menu = "RADIOSITY_PT_presets"
    preset_subdir = FOLDER
    preset_defines = ["radiosity = bpy.context.scene.radiosity"]

    preset_values = [
        f"radiosity.{name}"
        for name in RadiositySettings.__annotations__
        if name not in NOT_IN_PRESETS
    ]


CLASSES = (RADIOSITY_PT_presets, RADIOSITY_OT_preset_add)
