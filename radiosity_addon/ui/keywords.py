"""The settings as keywords of the bake operator: for one bake, in place of the scene's."""

from __future__ import annotations

from types import SimpleNamespace

from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from .enum_items import CUSTOM
from .properties import RadiositySettings

# Not to be given as a keyword: what is kept, and the error in another unit.
NO_KEYWORDS = ("report", "error_percent")
KEYWORDS = tuple(n for n in RadiositySettings.__annotations__ if n not in NO_KEYWORDS)
# What is meant along with a keyword, where it is not given itself.
IMPLIED = {
    "error": ("quality", CUSTOM),
    "time_limit": ("use_time_limit", True),
    "image_dir": ("write_files", True),
    "format": ("write_files", True),
    "atlas": ("use_atlas", True),
    "atlas_images": ("use_atlas", True),
    "density": ("use_atlas", True),
}
# Keywords that one target alone has a use for.
ONLY_FOR = {
    "IMAGE": ("resolution", "height", "uv_map", "unwrap", "margin", "use_atlas", "atlas",
              "atlas_images", "density", "write_files", "image_dir", "format"),
    "VERTEX": ("domain", "byte_colors"),
}  # fmt: skip
PROPERTIES = {"BOOLEAN": BoolProperty, "INT": IntProperty, "FLOAT": FloatProperty,
         "STRING": StringProperty, "ENUM": EnumProperty}  # fmt: skip
# What the registered property calls a word of its declaration, where it differs.
NUMBER = {"min": "hard_min", "max": "hard_max", "soft_min": "soft_min", "soft_max": "soft_max",
          "step": "step", "subtype": "subtype"}  # fmt: skip
WORDS = {"BOOLEAN": {}, "INT": NUMBER, "FLOAT": {**NUMBER, "precision": "precision"},
         "STRING": {"maxlen": "length_max", "subtype": "subtype"}, "ENUM": {}}  # fmt: skip


def annotations() -> dict:
    """The keywords as properties of an operator. The scene's must be registered."""
    registered = RadiositySettings.bl_rna.properties
    return {name: _like(registered[name]) for name in KEYWORDS}


def _like(each):
    """A property as ``each``, whose value an operator does not remember from call to call."""
    words = {word: getattr(each, name) for word, name in WORDS[each.type].items()}
    options, flags = {"SKIP_SAVE"}, each.type == "ENUM" and each.is_enum_flag
    if each.type == "ENUM":
        words["items"] = [(i.identifier, i.name, i.description) for i in each.enum_items]
    if flags:
        options.add("ENUM_FLAG")
    words["default"] = set(each.default_flag) if flags else each.default
    return PROPERTIES[each.type](
        name=each.name, description=each.description, options=options, **words
    )


def with_keywords(properties: RadiositySettings, operator) -> SimpleNamespace:
    """The scene's settings, and in place of some those that ``operator`` was given."""
    asked = given_to(operator)
    for name, (other, value) in IMPLIED.items():
        if name in asked:
            asked.setdefault(other, value)
    return SimpleNamespace(**{**{name: getattr(properties, name) for name in KEYWORDS}, **asked})


def given_to(operator) -> dict:
    """The keywords of a call, and their values."""
    given = getattr(operator, "properties", None)
    if given is None:
        return {}
    return {name: getattr(given, name) for name in KEYWORDS if given.is_property_set(name)}


def without_use(target: str, operator) -> list[str]:
    """The keywords that ``operator`` was given and that change nothing for this target."""
    given = given_to(operator)
    return [name for other, names in ONLY_FOR.items() if other != target for name in names if name in given]
