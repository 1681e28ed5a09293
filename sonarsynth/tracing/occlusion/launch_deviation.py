"""Where bent rays leave for hydrophones: beside the directions towards the images of these, beside that of the centre.

Those directions are what straight rays have. In water that bends rays they are off by the size of the array over the
distance, times what the rays' spreading differs from that of straight ones.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.products.array_expansion import monomials_at
from sonarsynth.state import Medium, Receiver
from sonarsynth.tracing.expansion.probe_paths import ReceiverGeometry, image, rays_to_probes
from sonarsynth.tracing.expansion.probe_sensors import probes
from sonarsynth.tracing.receive_paths import ReceivePaths

if TYPE_CHECKING:
    from sonarsynth.propagation import Propagation


def launch_deviation(
    legs: ReceivePaths, points: Floats, medium: Medium, receiver: Receiver, propagation: Propagation
) -> Floats:
    """(leg, point, xyz) what is between the directions in which rays leave for points (point, xyz) m of the sonar
    frame, on the aperture, and those towards their images; medium: what bends them.

    Cubics through rays to the probes of the aperture. Where a probe has no ray, it is taken to be where straight ones
    are.
    """
    geometry = ReceiverGeometry(medium, receiver, probes(receiver.elements), propagation)
    probe, straight = geometry.probe, image(legs, geometry.probe.position, receiver.pose)
    residual, _, bent = rays_to_probes(legs, geometry)
    away = np.where(np.isnan(residual)[..., None], 0.0, bent - straight)
    basis = monomials_at(points, probe.aperture, probe.monomials)
    coefficients = np.einsum("tp,lpx->ltx", probe.solve, away[:, : probe.fitted], optimize=True)
    return np.asarray(np.matmul(basis, coefficients))
