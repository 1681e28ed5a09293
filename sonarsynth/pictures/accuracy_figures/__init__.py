"""Figures of error against run time."""
