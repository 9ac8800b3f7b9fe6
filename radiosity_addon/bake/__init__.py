"""Bake: from light at the receivers to colours on the user's objects."""
