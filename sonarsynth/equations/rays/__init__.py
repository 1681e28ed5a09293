"""Eigenrays in layered water."""
