"""Blender's own glTF exporter, with our hook in it for as long as one export takes. bpy."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from pathlib import Path

from ..bake.image import holds_bake
from ..solver.expected import Refused
from .dress import CARRIED, TAG

PACKAGE = __package__.rpartition(".")[0]  # what Blender knows as the add-on
HOOK = "glTF2ExportUserExtension"  # where the exporter looks, in the modules of enabled add-ons
OPTIONS = {
    "export_format": "GLB",
    "export_apply": True,  # modifiers: engines have none
    "use_renderable": True,
    "use_active_scene": True,
    "export_attributes": True,  # the hook chooses which
    "export_animations": False,
    "export_lights": False,  # their light is in the bake
    "export_cameras": True,
    "check_existing": False,
    "will_save_settings": False,
}  # fmt: skip


def export_glb(path: str | Path, objects: set[str], names: dict[str, str]) -> None:
    """Export the open scene with the attributes ``names`` (Blender's name: ours) carried along
    and the nodes of ``objects`` tagged. Raises Refused with the exporter's reason.
    """
    import bpy

    if "gltf" not in dir(bpy.ops.export_scene):
        raise Refused("Blender's glTF exporter is off; enable the add-on glTF 2.0 format")
    failures: list[Exception] = []
    with _hooked(_recording(_hook_class(objects, names), failures)):
        known = bpy.ops.export_scene.gltf.get_rna_type().properties.keys()
        options = {key: value for key, value in OPTIONS.items() if key in known}
        try:
            bpy.ops.export_scene.gltf(filepath=str(Path(path).resolve()), **options)
        except RuntimeError as error:
            if failures:
                raise failures[0] from error
            lines = str(error).strip().splitlines() or ["no reason given"]
            raise Refused(f"Blender's glTF exporter failed: {lines[-1]}") from error
    if failures:
        raise failures[0]  # which exporters before Blender 5.1 only log
    if not Path(path).is_file():
        raise Refused("Blender's glTF exporter wrote nothing; is there a mesh to export?")


def warn_of_plain_export(log) -> None:
    """Have the exporter say what it makes of a bake that it was not asked for through us; ``log`` is
    its own, whose warnings it reports."""
    if not hasattr(sys.modules[PACKAGE], HOOK) and holds_bake():
        log.warning(
            "Radiosity: this export cuts baked colors at 1, and leaves a bake out where no material shows "
            "it; Export glTF in the Radiosity tab puts it where engines look"
        )


def _hook_class(objects: set[str], names: dict[str, str]):
    """The class that the exporter makes its hook of."""

    class Carry:
        is_critical = True  # a failure ends the export

        def gather_attribute_keep(self, attribute, settings):
            attribute.keep = attribute.attr_name in names
            attribute.attr_name = names.get(attribute.attr_name, attribute.attr_name)

        def gather_node_hook(self, node, item, settings):
            if item is not None and getattr(item, "name", None) in objects:
                node.extras = {**(node.extras or {}), TAG: item.name}

    return Carry


def _recording(hook, failures: list[Exception]):
    """``hook`` with what its methods raise added to ``failures``: exporters before Blender 5.1 go on
    as if nothing had happened."""

    def recorded(method):
        def call(self, *words):
            try:
                return method(self, *words)
            except Exception as error:
                failures.append(error)
                raise

        return call

    methods = {
        name: recorded(getattr(hook, name)) for name in dir(hook) if name.startswith("gather_")
    }
    return type(hook.__name__, (hook,), methods)


@contextmanager
def _hooked(hook):
    """Our package is an enabled add-on that has the hook, inside; outside all is as before.

    On a command line the package is no add-on of Blender's: it is entered in the preferences,
    which are not saved.
    """
    import bpy

    module, addons = sys.modules[PACKAGE], bpy.context.preferences.addons
    entry = None
    if PACKAGE not in addons:
        entry = addons.new()
        entry.module = PACKAGE
    setattr(module, HOOK, hook)
    try:
        yield
    finally:
        delattr(module, HOOK)
        if entry is not None:
            addons.remove(addons[PACKAGE])


def carried(attributes) -> dict[str, str]:
    """The names that attributes and UV maps travel by, one each: the exporter does not say whose they
    are, and what one mesh calls its UV map may be a color on another."""
    return {name: f"{CARRIED}{number}" for number, name in enumerate(sorted(set(attributes)))}
