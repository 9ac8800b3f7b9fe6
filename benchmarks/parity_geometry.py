"""Parity cases of geometry. Depends on bpy."""

CASES = ()
