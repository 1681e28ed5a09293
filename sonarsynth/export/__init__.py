"""Points of many frames as one cloud, and files for other programs: of points, of images and boxes (COCO), of signals
and beams (SONAR-netCDF4), and of the water for Bellhop."""

from sonarsynth.export.bellhop_files import write_bellhop
from sonarsynth.export.fused_points import points
from sonarsynth.export.point_files import FORMATS, write_points

__all__ = ["FORMATS", "points", "write_bellhop", "write_points"]
