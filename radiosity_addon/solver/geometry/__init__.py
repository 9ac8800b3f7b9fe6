"""Geometry: triangles, footprints, clusters and grids, and closed formulas for polygons."""
