"""Bake: from light at the receivers to colors on the user's objects."""
