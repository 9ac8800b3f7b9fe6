"""The sidebar tab. Panels only lay out: what they show is computed elsewhere."""

import bpy

from . import session, view
from .choice import why_not
from .enum_items import CUSTOM
from .lines import draw_note
from .preflight_panel import draw_preflight
from .presets import RADIOSITY_PT_presets
from .progress_bar import CATEGORY, draw_progress


class RadiosityPanel:
    """Where every panel of the tab is."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = CATEGORY

    def split_layout(self):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        return layout


class RADIOSITY_PT_bake(RadiosityPanel, bpy.types.Panel):
    bl_label = "Radiosity"

    def draw_header_preset(self, context):
        RADIOSITY_PT_presets.draw_panel_header(self.layout)

    def draw(self, context):
        layout = self.split_layout()
        properties = context.scene.radiosity
        bake = session.current()
        if bake is None:
            draw_button(layout, context)
            draw_preflight(self.layout, context)
        else:
            draw_progress(layout.column(), bake)
        column = layout.column()
        column.enabled = bake is None
        column.prop(properties, "objects_from")
        column.prop(properties, "quality")
        if properties.quality == CUSTOM:
            column.prop(properties, "error_percent")


def draw_button(layout, context) -> None:
    """The button, and below it why it is gray while it is."""
    row = layout.row()
    row.scale_y = 1.5
    row.operator("radiosity.bake", text="Bake", icon="RENDER_STILL")
    reason = why_not(context)
    if reason:
        draw_note(layout.column(align=True), reason, "INFO")


class RADIOSITY_PT_target(RadiosityPanel, bpy.types.Panel):
    bl_label = "Target"
    bl_parent_id = "RADIOSITY_PT_bake"

    def draw(self, context):
        layout = self.split_layout()
        properties = context.scene.radiosity
        layout.enabled = session.current() is None
        layout.prop(properties, "target", text="Bake To")
        layout.prop(properties, "bake_name")
        if properties.target == "VERTEX":
            layout.prop(properties, "domain")
            layout.prop(properties, "byte_colors")
            if properties.byte_colors:
                layout.prop(properties, "auto_scale")
            return
        column = layout.column(align=True)
        column.prop(properties, "resolution")
        column.prop(properties, "height")
        item = context.object if context.object and context.object.type == "MESH" else None
        if item is not None:
            layout.prop_search(properties, "uv_map", item.data, "uv_layers", icon="GROUP_UVS")
        else:
            layout.prop(properties, "uv_map", icon="GROUP_UVS")
        if not properties.uv_map.strip():
            layout.prop(properties, "unwrap")
        layout.prop(properties, "margin")
        if item is not None and not properties.use_atlas:
            draw_own(layout, item, "radiosity_own_resolution")


def draw_own(layout, item, name: str) -> None:
    """What is asked of the active object alone, below its name."""
    column = layout.column(align=True)
    row = column.split(factor=0.4)
    row.label()
    row.label(text=item.name, icon="OBJECT_DATA", translate=False)
    column.prop(item, name)


class ImagePanel(RadiosityPanel):
    """A part of *Target* for images alone, which the property ``switch`` turns on."""

    bl_parent_id = "RADIOSITY_PT_target"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return context.scene.radiosity.target == "IMAGE"

    def draw_header(self, context):
        self.layout.prop(context.scene.radiosity, self.switch, text="")

    def switched_layout(self, properties):
        """As ``split_layout``, gray while the part is off or a bake runs."""
        layout = self.split_layout()
        layout.enabled = getattr(properties, self.switch) and session.current() is None
        return layout


class RADIOSITY_PT_atlas(ImagePanel, bpy.types.Panel):
    bl_label = "Atlas"
    switch = "use_atlas"

    def draw(self, context):
        properties = context.scene.radiosity
        layout = self.switched_layout(properties)
        layout.prop(properties, "atlas", text="Name")
        if properties.uv_map.strip():
            layout.label(text="The UV map is used as it is", icon="INFO")
            return
        layout.prop(properties, "density")
        layout.prop(properties, "atlas_images")
        item = context.object
        if item is not None and item.type == "MESH":
            draw_own(layout, item, "radiosity_density_factor")


class RADIOSITY_PT_files(ImagePanel, bpy.types.Panel):
    bl_label = "Image Files"
    switch = "write_files"

    def draw(self, context):
        properties = context.scene.radiosity
        layout = self.switched_layout(properties)
        layout.prop(properties, "image_dir")
        layout.prop(properties, "format")
        if properties.format in {"PNG", "PNG16"}:
            layout.prop(properties, "auto_scale")


class RADIOSITY_PT_passes(RadiosityPanel, bpy.types.Panel):
    bl_label = "Passes"
    bl_parent_id = "RADIOSITY_PT_bake"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.enabled = session.current() is None
        layout.column(align=True).prop(context.scene.radiosity, "passes")


class RADIOSITY_PT_advanced(RadiosityPanel, bpy.types.Panel):
    bl_label = "Advanced"
    bl_parent_id = "RADIOSITY_PT_bake"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.split_layout()
        properties = context.scene.radiosity
        layout.enabled = session.current() is None
        row = layout.row(heading="Time Limit")
        row.prop(properties, "use_time_limit", text="")
        part = row.row()
        part.enabled = properties.use_time_limit
        part.prop(properties, "time_limit", text="")
        layout.prop(properties, "shading_normals")
        layout.prop(properties, "glossy_bounces")
        layout.prop(properties, "threads")
        layout.prop(properties, "seed")


class RADIOSITY_PT_result(RadiosityPanel, bpy.types.Panel):
    bl_label = "Result"
    bl_parent_id = "RADIOSITY_PT_bake"

    def draw(self, context):
        column = self.layout.column(align=True)
        shown = view.shows(context.space_data)
        column.operator(
            "radiosity.show",
            text="Back to Normal View" if shown else "Show Result",
            icon="LOOP_BACK" if shown else "SHADING_SOLID",
            depress=shown,
        )
        row = column.row(align=True)
        row.operator("radiosity.build_material", text="Build Material", icon="MATERIAL")
        row.operator("radiosity.build_material", text="Build and Put On").assign = True
        column.operator("radiosity.export_gltf", text="Export glTF", icon="EXPORT")
        row = column.row(align=True)
        row.operator("radiosity.remove_bake", icon="TRASH")
        row.menu("RADIOSITY_MT_remove", text="", icon="DOWNARROW_HLT")


CLASSES = (
    RADIOSITY_PT_bake,
    RADIOSITY_PT_target,
    RADIOSITY_PT_atlas,
    RADIOSITY_PT_files,
    RADIOSITY_PT_passes,
    RADIOSITY_PT_advanced,
    RADIOSITY_PT_result,
)
