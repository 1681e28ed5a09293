"""Echoes that come from a point beside the middle of their facet, as those of rough ones do, over the aperture.

What the point is nearer or farther than the middle differs from hydrophone to hydrophone: by its distance from there
over that from the array, times the aperture. The wavefront is that of the point, not of the middle.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Floats, Ints, depth
from sonarsynth.equations.scattering.lobes import dot
from sonarsynth.geometry import Pose
from sonarsynth.products import ArrayExpansion, Arrivals
from sonarsynth.tracing.expansion.probe_sensors import probes
from sonarsynth.tracing.receive_paths import ReceivePaths

if TYPE_CHECKING:
    from sonarsynth.tracing.facet_paths import FacetPaths


def shift_to_scattering_points(arrivals: Arrivals, legs: ReceivePaths, spot: Floats, sonar_pose: Pose) -> Arrivals:
    """Arrivals through uniform water that seem to come from points `spot` (path, xyz) m, world, off the start of their
    legs, or from the images of these: exact."""
    rows = np.flatnonzero(spot.any(axis=1))
    mirrored = spot[rows]
    mirrored[legs.bounces[rows] % 2 == 1, 2] *= -1.0
    apparent = arrivals.radius[rows, None] * arrivals.direction[rows] + sonar_pose.turn_to_body(mirrored)
    direction, radius = arrivals.direction.copy(), arrivals.radius.copy()
    radius[rows] = np.sqrt(dot(apparent, apparent))
    direction[rows] = apparent / radius[rows, None]
    return arrivals.but(direction=direction, radius=radius)


def delay_to_scattering_points(over: ArrayExpansion, array: FacetPaths, leg: Ints, spot: Floats) -> ArrayExpansion:
    """Wavefronts of paths by legs (path,) through water that bends them, with what points `spot` (path, xyz) m, world,
    are farther from each hydrophone, beside the array centre: by the directions in which rays leave, for points much
    nearer to the middle than to the array."""
    rows = np.flatnonzero(spot.any(axis=1))
    away = array.fronts.departure(leg[rows]) - array.legs.departure[leg[rows], None]
    speed = array.context.medium.profile.at(depth(array.legs.point[leg[rows]]))
    late = -dot(spot[rows, None], away) / speed[:, None]
    delay = over.delay.copy()
    delay[rows] += probes(array.context.receiver.elements).expand(late)[0]
    return over.but(delay=delay)
