"""Rays by independent methods: shooting, images, arithmetic of many digits."""
