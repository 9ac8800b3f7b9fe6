"""Materials: reflectance, emission and transmittance at points, and their exact means."""
