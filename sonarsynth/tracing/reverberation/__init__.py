"""Scatterers of bottom, surface and water: where they are, what they send to the array, and which are worth it."""
