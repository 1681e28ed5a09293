"""How facets scatter, written again from the equations of the laws."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.randomness import stream
from sonarsynth.scattering import Isotropic, MirrorLobe, Scattering


def known(law: Scattering) -> bool:
    """Whether a law is one of those below."""
    return isinstance(law, MirrorLobe | Isotropic)


def signs(law: Scattering, mesh: Mesh) -> Floats:
    """Sign (facet,) of each facet's echo: drawn once for a mesh, where the law says so."""
    if isinstance(law, MirrorLobe) and law.phases == "random":
        return np.asarray(stream(0, "polarity", mesh.digest).choice([-1.0, 1.0], len(mesh.faces)))
    return np.ones(len(mesh.faces))


def amplitudes(law: Scattering, incident: Floats, scattered: Floats, normal: Floats, area: Floats) -> Floats:
    """Scattering amplitude (facet,) m for unit vectors of travel in and away (facet, xyz); 0 where a facet is not lit,
    or not seen.

    Mirror lobe of width w: the surface has the rms slope s = w/sqrt 8, and with b the angle of the half vector from the
    normal sends sigma = exp(-tan^2 b/(2 s^2))/(8 pi s^2 cos^4 b) per area and solid angle (Barrick 1968), and
    Lambert's part of the rest.
    """
    inward, outward = -np.einsum("nx,nx->n", incident, normal), np.einsum("nx,nx->n", scattered, normal)
    visible = (inward > 0.0) & (outward > 0.0)
    if isinstance(law, Isotropic):
        return np.where(visible, law.strength, 0.0)
    assert isinstance(law, MirrorLobe)
    half = scattered - incident
    cosine = np.maximum((inward + outward) / np.maximum(np.linalg.norm(half, axis=1), 1e-300), 1e-9)
    square, slope = cosine**2, law.width / np.sqrt(8.0)
    lobe = np.exp(-(1.0 / square - 1.0) / (2.0 * slope**2)) / (8.0 * np.pi * slope**2 * square**2)
    power = law.reflectivity**2 * lobe + law.diffuse / np.pi * inward * outward
    return np.where(visible, np.sqrt(area * np.where(visible, power, 0.0)), 0.0)
