"""Parity cases of materials. Depends on bpy."""

CASES = ()
