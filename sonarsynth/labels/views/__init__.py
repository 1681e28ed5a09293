"""What the array sees of bodies: apparent places, visible and lit facets, their boxes, and what they cover of beams."""

from sonarsynth.labels.views.box_in_view import box_in_view

__all__ = ["box_in_view"]
