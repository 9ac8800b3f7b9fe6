"""Scene → Solution: elements, rays, form factors, linear solve, direct light, gather, error.

Imports only NumPy, SciPy and embreex; works where Blender is not installed.
"""
