"""Locating the source from the signals."""
