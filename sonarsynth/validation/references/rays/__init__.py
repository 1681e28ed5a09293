"""Rays by independent methods: shooting, images, rays followed leg by leg."""
