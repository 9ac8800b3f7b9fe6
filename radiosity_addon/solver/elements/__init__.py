"""Elements: the surface divided where no receiver is fine enough."""
