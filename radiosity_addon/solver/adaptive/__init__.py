"""Adaptive: what to spend for an asked error, from two independent replicates."""
