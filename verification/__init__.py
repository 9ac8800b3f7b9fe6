"""Verification: exact solutions, an independent path tracer, error measures, scenes with known
answers. Tests and benchmarks import it; it imports neither."""
