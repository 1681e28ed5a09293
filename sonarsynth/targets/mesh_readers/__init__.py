"""Mesh files: reading, checking and repairing them."""
