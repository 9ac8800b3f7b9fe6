"""Sampling: low-discrepancy and random numbers, points, directions, the guide."""
