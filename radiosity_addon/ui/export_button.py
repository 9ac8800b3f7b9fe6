"""A button that writes the scene with its bake as glTF."""

import bpy
from bpy.props import StringProperty
from bpy_extras.io_utils import ExportHelper

from ..solver.expected import EXPECTED
from .properties import settings_of
from .results import CarriesBake, baked_objects


class RADIOSITY_OT_export_gltf(CarriesBake, bpy.types.Operator, ExportHelper):
    """Write the scene as glTF with the bake where engines look for it: vertex colors alone in
    COLOR_0, images as lightmaps on a second UV map. Target and name are those above"""

    bl_idname = "radiosity.export_gltf"
    bl_label = "Export glTF with Bake"

    filename_ext = ".glb"
    filter_glob: StringProperty(default="*.glb", options={"HIDDEN"})

    def execute(self, context):
        # Here, as enabling the add-on must be quick.
        from ..files import Publication, check_writable, naming
        from ..gltf.export_bake import baked_with, export_bake

        names = tuple(item.name for item in baked_objects(context))
        try:
            check_writable(self.filepath, "the export")
            with Publication() as files:
                baked = baked_with(settings_of(context.scene.radiosity), names)
                with naming(self.filepath, "the export"):
                    warnings = export_bake(baked, files.stage(self.filepath))
                files.commit()
        except EXPECTED as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for text in warnings:
            self.report({"WARNING"}, text)
        self.report({"INFO"}, f"{bpy.path.basename(self.filepath)}: {len(names)} baked")
        return {"FINISHED"}


CLASSES = (RADIOSITY_OT_export_gltf,)
