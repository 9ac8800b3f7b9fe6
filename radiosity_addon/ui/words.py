"""Numbers in words, for panels, and settings by their labels. The templates are whole sentences, so that
they translate."""

import re

from bpy.app.translations import pgettext_iface as iface_

from .properties import RadiositySettings

# What an option is in the panel, where it is not the property of its name.
PROPERTIES = {"objects": "objects_from", "name": "bake_name", "scale": "auto_scale", "color_type": "byte_colors"}
BUTTONS = {"single_user": "Make Meshes Single-User"}


def by_labels(text: str) -> str:
    """The text with the command line's options (``--density``) as the panel's labels (*Density*)."""
    return re.sub(r"--([a-z]+(?:-[a-z]+)*)", _label, text)


def _label(option: re.Match) -> str:
    name = option[1].replace("-", "_")
    found = RadiositySettings.bl_rna.properties.get(PROPERTIES.get(name, name))
    return iface_(BUTTONS.get(name, found.name if found else option[0]))


def duration(seconds: float) -> str:
    """``3 s``, ``2 min 5 s``, ``1 h 20 min``."""
    if seconds < 1:
        return iface_("{:.2f} s").format(seconds)
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return iface_("{:d} h {:d} min").format(hours, minutes)
    if minutes:
        return iface_("{:d} min {:d} s").format(minutes, rest)
    return iface_("{:d} s").format(rest)


def size(number: float) -> str:
    """Bytes as ``350 MB`` or ``1.2 GB``."""
    if number < 1e9:
        return iface_("{:.0f} MB").format(number / 1e6)
    return iface_("{:.1f} GB").format(number / 1e9)


def count(number: int) -> str:
    """Thousands apart: ``1,234,567``."""
    return f"{number:,}"
