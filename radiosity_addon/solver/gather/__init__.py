"""Gather: light at receivers by rays, and what it lacks by paths along the residual."""
