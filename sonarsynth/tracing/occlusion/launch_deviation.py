"""Where bent rays leave for hydrophones: beside the directions towards the images of these, beside that of the centre.

Those directions are what straight rays have. In water that bends rays they are off by the size of the array over the
distance, times what the rays' spreading differs from that of straight ones.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Bools, Floats, depth
from sonarsynth.products.array_expansion import aperture_terms
from sonarsynth.state import Medium, Receiver
from sonarsynth.tracing.expansion.probe_paths import ReceiverGeometry, image, rays_to_probes
from sonarsynth.tracing.expansion.probe_sensors import probes
from sonarsynth.tracing.receive_paths import ReceivePaths

if TYPE_CHECKING:
    from sonarsynth.propagation import Propagation

SAME = 1e-9
"""Largest distance of two directions of one ray, found in two ways."""


def launch_deviation(
    legs: ReceivePaths, points: Floats, medium: Medium, receiver: Receiver, propagation: Propagation
) -> Floats:
    """(leg, point, xyz) what is between the directions in which rays leave for points (point, xyz) m of the sonar
    frame, on the aperture, and those towards their images; medium: what bends them.

    Cubics through rays to the probes of the aperture: arcs where these do not leave a layer of
    constant gradient, others traced. Where a probe has no ray, it is taken to be where straight ones are.
    """
    geometry = ReceiverGeometry(medium, receiver, probes(receiver.elements), propagation)
    probe, offset = geometry.probe, receiver.pose.turn_to_world(geometry.probe.position)
    away, arc = _arcs(legs, receiver.pose.position, offset, medium)
    straight = image(legs, geometry.probe.position, receiver.pose)
    traced = np.flatnonzero(~arc)
    if len(traced):
        residual, _, bent = rays_to_probes(legs.select(traced), geometry)
        away[traced] = np.where(np.isnan(residual)[..., None], straight[traced], bent)
    away -= straight
    basis = aperture_terms(points, probe.aperture)
    coefficients = np.einsum("tp,lpx->ltx", probe.solve, away[:, : probe.fitted], optimize=True)
    return np.asarray(np.matmul(basis, coefficients))


def _arcs(legs: ReceivePaths, centre: Floats, offset: Floats, medium: Medium) -> tuple[Floats, Bools]:
    """Directions (leg, point, xyz) of rays to places beside the centre (point, xyz) m, world, of legs that keep to one
    layer, with some room; and which (leg,) legs these are.

    In a layer of constant gradient g the centre of the circle is at the depth where c would be 0 and equally far from
    both ends, so the tangent of the grazing angle at the start, down positive, is (dz (c + c') / X + g X) / 2 c.
    """
    directions = np.zeros((len(legs.row), len(offset), 3))
    nodes, speed = medium.profile.depth, medium.profile.speed
    ends = np.append(depth(centre + offset), depth(centre))
    layer = np.searchsorted(nodes, ends.min(), "right") - 1
    if layer < 0 or layer + 1 >= len(nodes):
        return directions, np.zeros(len(legs.row), bool)
    top, low = float(nodes[layer]), min(float(nodes[layer + 1]), medium.depth)
    gradient = float((speed[layer + 1] - speed[layer]) / (nodes[layer + 1] - top))
    z = depth(legs.point)
    bow = abs(gradient) / float(speed[layer : layer + 2].min()) * (legs.length + np.abs(offset).sum(axis=1).max()) ** 2
    within = (np.minimum(z, ends.min()) - bow >= top) & (np.maximum(z, ends.max()) + bow <= low)
    rows = np.flatnonzero(within & (legs.bounces == 0))
    to = np.concatenate([np.zeros((1, 3)), offset])[None] + (centre - legs.point[rows])[:, None]
    level = np.hypot(to[..., 0], to[..., 1])
    c = (float(speed[layer]) + gradient * (z[rows] - top))[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        down = 0.5 * (-to[..., 2] * (2.0 - gradient * to[..., 2] / c) / level + gradient * level / c)
        cosine = 1.0 / np.hypot(1.0, down)
        ahead = np.concatenate([to[..., :2] * (cosine / level)[..., None], (-down * cosine)[..., None]], axis=2)
        same = np.abs(ahead[:, 0] - legs.departure[rows]).max(axis=1) <= SAME
    same &= np.isfinite(ahead).all(axis=(1, 2))
    directions[rows[same]] = ahead[same, 1:]
    is_arc = np.zeros(len(legs.row), bool)
    is_arc[rows[same]] = True
    return directions, is_arc
