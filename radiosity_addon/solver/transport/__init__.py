"""Transport: patches, rows of form factors and the linear system that gives radiosities."""
