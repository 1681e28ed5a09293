"""What an array cannot tell apart: front from back, where its hydrophones lie in a plane."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.receiver.hydrophones import Elements

ALIKE = 1.0
"""rad: hydrophones whose phases differ by less, of a wave and of its mirror image, are in one plane."""


def mirror_normal(elements: Elements, wavelength: float) -> Floats | None:
    """Unit normal (xyz), sonar frame, of the plane that the live hydrophones lie in at a wavelength (m), or None.

    They are in a plane where no phase of a wave differs by `ALIKE` or more from that of the wave's mirror image: at
    most 4 pi/wavelength times the distance of a hydrophone from the plane. Sound from behind then is heard as from its
    mirror image in front, for elements have no back: a face hears alike from both sides
    (`apertures.element_directivity`). Of a line of hydrophones, which has many such planes, the one that faces
    x most. None for a single hydrophone, which has no directions, and for one line of them along x.
    """
    return plane_normal(elements.position[elements.gain > 0.0], wavelength)


def plane_normal(live: Floats, wavelength: float) -> Floats | None:
    """The same of the positions (sensor, xyz) m of the live hydrophones."""
    if len(live) < 2:
        return None
    about = live - live.mean(axis=0)
    axes = np.linalg.svd(np.linalg.qr(about, mode="r"), full_matrices=True)[2]
    near = np.abs(about @ axes.T).max(axis=0) * (4.0 * np.pi / wavelength) < ALIKE
    if near[0] or not near[2]:
        return None
    normal = axes[2]
    if near[1]:  # a line
        normal = np.array([1.0, 0.0, 0.0]) - axes[0, 0] * axes[0]
    size = float(np.linalg.norm(normal))
    if size < 1e-9:
        return None
    return np.asarray(normal / (size if normal[0] >= 0.0 else -size))


def mirror_image(direction: Floats, normal: Floats) -> Floats:
    """Directions (..., xyz) mirrored in the plane with a unit normal (xyz): heard alike by an array in that plane."""
    u = np.asarray(direction, float)
    return np.asarray(u - 2.0 * (u @ normal)[..., None] * normal)
