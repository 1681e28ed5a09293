"""Rays of a frame, drawn: a vertical section, in space, and as a page to turn."""
