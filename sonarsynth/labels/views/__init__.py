"""What the array sees of bodies: apparent places, visible and lit facets, their boxes, and what they cover of beams."""

from sonarsynth.labels.views.box_in_view import MEANINGS, View, box_in_view

__all__ = ["MEANINGS", "View", "box_in_view"]
