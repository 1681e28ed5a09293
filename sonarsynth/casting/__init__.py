"""Rays and narrow cones cast at triangle meshes."""
