"""glTF: the bake in the file that engines read. Blender's exporter writes it, we put the bake in."""
