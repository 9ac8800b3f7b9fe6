"""Lights: the types of light as batches, choosing among many, the sky."""
