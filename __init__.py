"""What Blender imports when the extension is enabled."""

from .radiosity_addon import glTF2_pre_export_callback, register, unregister

__all__ = ("glTF2_pre_export_callback", "register", "unregister")
