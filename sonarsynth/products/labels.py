"""Labels: truth of a frame, whose echoes its points are, and levels that add up."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats, Ints
from sonarsynth.products.paths import Arrivals

ORIGINS = ("main lobe", "side lobe", "grating lobe", "mirror image", "snap itself", "unexplained", "reverberation")
"""How the array came to hear what made a point: in the beam, beside it, through a lobe that a lattice has in other
directions, from behind a planar array, from no target but the snap (its direct pulse, or one that surface or bottom
reflects), or from no path of the frame: noise, or what cancelling leaves."""


SPLITS = ("train", "validation", "test")
"""Names of the splits, in the order of their numbers in the store."""


class View(IntEnum):
    """How much of what the array sees of a body lies between the first and the last beam, each way."""

    IN_VIEW = 0
    PARTLY_IN_VIEW = 1
    OUTSIDE_VIEW = 2
    BEHIND = 3
    HIDDEN = 4


VIEWS = " ".join(view.name.lower() for view in View)
"""Words of the flags of a `View`, in the order of their values."""


@dataclass(frozen=True, eq=False)
class PointLabels:
    """Whose echo each point is: the target, snap and family whose paths bring most energy in the beam at its delay.

    -1 and NaN where nothing explains it. The emission of a point is not that of the sonar's clock
    where another snap lit it: its range is wrong then.
    """

    target: npt.NDArray[np.int16]  # (point,) -1 for none: the snap itself
    emission: npt.NDArray[np.int16]  # (point,) which snap
    family: npt.NDArray[np.int8]  # (point,) index into FAMILIES: how it reached the array; not direct: a ghost
    lit_by: npt.NDArray[np.int8]  # (point,) index into FAMILIES: how sound reached the target; not direct: too far off
    facet: npt.NDArray[np.int32]  # (point,) that brings most; -1 for none
    true_range: npt.NDArray[np.float32]  # (point,) m from the array centre to what is heard of the target
    distance: npt.NDArray[np.float32]  # (point,) m from the point to the nearest surface of the target
    origin: npt.NDArray[np.int8]  # (point,) index into ORIGINS


@dataclass(frozen=True, eq=False)
class Truth:
    """Exact ground truth of a frame, from the same arrivals that made the signals.

    Poses in the world are those of the frame's instant. What is heard is of when the sound met the target: where it was
    then, and how it lay, is `position_at_echo` and `orientation_at_echo`. Boxes and beams, in the sonar's frame, are of
    that too, and of where the array was when it heard it.
    """

    sonar_position: Floats  # (xyz) m, world
    sonar_orientation: Floats  # (wxyz)
    sonar_velocity: Floats  # (xyz) m/s, world: mean until echoes of the loudest snap are heard
    sonar_spin: Floats  # (xyz) rad/s, world: the same of its angular velocity
    target_position: Floats  # (target, xyz) m, world
    target_orientation: Floats  # (target, wxyz)
    target_velocity: Floats  # (target, xyz) m/s, world
    meeting_time: Floats  # (snap, target) s: when the sound of each snap, by the direct path, meets the target's origin
    position_at_echo: Floats  # (snap, target, xyz) m, world: the origin then; NaN where no direct path leads to it
    orientation_at_echo: Floats  # (snap, target, wxyz) then, as target_orientation; or NaN
    box: Floats  # (target, corner 8, xyz) m: oriented bounding box, sonar frame
    box_centre: Floats  # (target, xyz) m, sonar frame
    box_size: Floats  # (target, xyz) m: of the box, along the target's axes
    box_orientation: Floats  # (target, wxyz) from the target's frame to the sonar's
    yaw: Floats  # (target,) rad: azimuth of the target's x axis, sonar frame, port positive; NaN where it is vertical
    image_box: Floats  # (target, 4): azimuth min, max, elevation min, max (rad) of what is seen and in view; or NaN
    true_image_box: Floats  # (target, 4) rad: the same by straight lines to where it is, not where it appears
    full_box: Floats  # (target, 4) rad: of all of it that is ahead, as it appears: hidden, and out of view, too; or NaN
    pixel_box: Floats  # (target, 4) x0, y0, x1, y1: image_box on the grid of beams, which are at whole numbers + 0.5
    view: npt.NDArray[np.int8]  # (target,) how much of it is in the view of the beams: `views.View`
    in_view: npt.NDArray[np.int8]  # (target,) 1: some of it is in the view of the beams, hidden or not
    truncation: Floats  # (target,) share of the solid angle of what is seen that is out of view; NaN: nothing is seen
    visible_fraction: Floats  # (target,) share of the area facing the array that the array sees, in view or not
    lit_fraction: Floats  # (snap, target) share of the area that is seen that the snap lights directly; NaN: none is
    snap_position: Floats  # (snap, xyz) m, world
    snap_time: Floats  # (snap,) s
    snap_level: Floats  # (snap,) dB re 1 uPa at 1 m
    beam_target: npt.NDArray[np.int16]  # (elevation, azimuth) -1 for none
    beam_facet: npt.NDArray[np.int32]  # (elevation, azimuth) -1 for none
    beam_range: npt.NDArray[np.float32]  # (elevation, azimuth) m to the first surface in the beam's direction
    beam_coverage: npt.NDArray[np.float32]  # (elevation, azimuth) share of the cell of the beam that bodies cover


@dataclass(frozen=True, eq=False)
class Echoes:
    """Where the echoes of each target come from, by the boundaries that they touched on their way to the array.

    What comes by surface or bottom is a ghost: the array sees the target mirrored there. Levels are of the energy in
    the band: phases count among the coherent paths of a snap and family (`LINK_BUDGET`), powers of all else are summed.
    Directions are weighted by the share of each path in that. NaN where no path comes that way, directions also where
    echoes come from several sides, as by surface and bottom both from above and from below.
    """

    azimuth: Floats  # (target, family) rad, sonar frame
    elevation: Floats  # (target, family) rad
    level: Floats  # (target, family) dB re 1 uPa: peak of a snap, times what the echoes bring of its energy in the band


LINK_BUDGET = (
    "source_level",
    "transmission_loss_out",
    "scattering",
    "transmission_loss_in",
    "absorption_loss",
    "boundary_loss",
    "received_level",
)
"""Terms of the link budget in dB: received = source - loss_out + scattering - loss_in - absorption - boundary.

Source is the peak level of the snap at 1 m before any filter. Received is that, and the ratio of the energy in the band
of the sonar that the paths of the family bring to the array centre over the energy that the snap has there at 1 m:
10 log10(sum_f |H S|^2 / sum_f |S|^2), S the spectrum of the snap through the anti-alias filter, H the transfer function
of the paths: coherent ones are summed with their phases, the powers of the others are added. Losses are ratios of sums
of the powers of the paths with and without one factor: means of the losses of the paths, weighted by power. Scattering
is what is left: the target strength, with what phases add or cancel; 0 dB of paths from snap to array.
"""


@dataclass(frozen=True, eq=False)
class LinkBudget:
    """Levels of each (snap, target, family) in dB that add up, and those of one path of it alone.

    The isolated path is the loudest of its family. Its level is predicted from the columns of `Arrivals`, over the band
    like the others; what is measured in the signals of that path alone must agree: `verify` compares the two.
    """

    level: Floats  # (snap, target + 1, family, term) dB; the last target is the direct path; NaN without paths
    paths: Ints  # (snap, target + 1, family)
    error_bound: Floats  # (snap, target + 1, family) dB
    isolated_level: Floats  # (snap, target + 1, family) dB re 1 uPa at the array centre; NaN without a path
    isolated: Arrivals  # the isolated paths, in the order of the levels that are not NaN
