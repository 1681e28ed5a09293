"""What varies between the sequences of a recipe: grids, random draws, meshes."""
