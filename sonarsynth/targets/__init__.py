"""What targets are: shapes, meshes, and how finely they must be cut."""
