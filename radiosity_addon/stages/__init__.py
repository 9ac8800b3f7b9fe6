"""The three stages of a bake: prepare (Blender), run (anywhere), apply (Blender)."""
