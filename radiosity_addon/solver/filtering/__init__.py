"""Filtering: sampled light smoothed among neighbors on the surface."""
