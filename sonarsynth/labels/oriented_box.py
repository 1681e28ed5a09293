"""The box about a body along its own axes, as the sonar has it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.geometry import Pose, quaternion_product, rotation_matrix
from sonarsynth.geometry.placed_target import PlacedTarget


class OrientedBox(NamedTuple):
    """Sizes along the axes of the body, about all of its mesh: its corners are centre + R (+-size/2), R the rotation of
    `orientation`, with x slowest and z fastest, minus first."""

    corners: Floats  # (8, xyz) m, sonar frame
    centre: Floats  # (xyz) m, sonar frame
    size: Floats  # (xyz) m, along the body's axes
    orientation: Floats  # (wxyz) unit quaternion from the body's frame to the sonar's, w >= 0
    yaw: float  # rad, sonar frame: azimuth of the body's x axis, port positive; NaN where it is vertical


def oriented_box(body: PlacedTarget, sonar_pose: Pose) -> OrientedBox:
    """The box of a body where it is."""
    low, high = body.mesh.box
    corners, centre = (sonar_pose.to_body(at) for at in (body.box, body.pose.to_world(0.5 * (low + high))))
    back = sonar_pose.orientation * [1.0, -1.0, -1.0, -1.0]
    turned = quaternion_product(back, body.pose.orientation)
    turned = -turned if turned[0] < 0.0 else turned
    forward = rotation_matrix(turned)[:, 0]
    level = float(np.hypot(forward[0], forward[1]))
    yaw = float(np.arctan2(forward[1], forward[0])) if level > 1e-9 else float("nan")
    return OrientedBox(corners, centre, high - low, turned, yaw)
