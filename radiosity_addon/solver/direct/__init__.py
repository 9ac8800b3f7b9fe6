"""Direct: irradiance from lights, shadows included."""
