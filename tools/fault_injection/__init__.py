"""Faults on purpose, and whether everything is as it was afterwards."""
