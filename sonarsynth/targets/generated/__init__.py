"""Meshes of shapes: boxes, bodies of revolution, REMUS-100."""
