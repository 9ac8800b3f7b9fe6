"""What Blender imports when the extension is enabled."""

from .radiosity_addon import register, unregister

__all__ = ("register", "unregister")
