"""Points of many frames as one cloud, and files of them for other programs."""

from sonarsynth.export.fused_points import points
from sonarsynth.export.point_files import FORMATS, write_points

__all__ = ["FORMATS", "points", "write_points"]
