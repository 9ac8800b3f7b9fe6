"""Tracing: rays by Embree, and which parts of the surface cut, cover or bury each other."""
