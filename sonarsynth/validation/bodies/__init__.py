"""Echoes of bodies against exact series and closed forms."""
