"""What a scattering law says of itself beside its amplitude: a new law may leave all of it as it is here."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Bools, Floats, direction
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.scattering.components import Component, Lobe
from sonarsynth.scattering.law_notes import evenly_in
from sonarsynth.scattering.law_validity import Scatterer
from sonarsynth.scattering.random_signs import random_polarity

DIRECTIONS, INCIDENCES = 16384, np.deg2rad([0.0, 20.0, 40.0, 60.0, 75.0])
"""In which the power of a new law is summed, and of which angles off the normal."""
MOST_RETURNED = 2.0
"""Times the power that arrives: by so few directions lobes under 1 degree come out as up to 1.3."""


class FacetLaw:
    """A law that repeats the pulse, by facets that have a random sign each and no phases: powers add."""

    kind: str

    def amplitude(
        self, incident: Floats, scattered: Floats, normal: Floats, area: Floats, beyond: bool = False
    ) -> Floats:
        """Far-field scattering amplitude (...) in m, for unit vectors of propagation in and away (..., xyz), facets'
        normals (..., xyz) and areas (...) in m2; 0 where a facet is not lit or, unless `beyond`, not seen."""
        raise NotImplementedError(f"{type(self).__name__} has no amplitude")

    def cross_section(
        self, corners: Floats, normal: Floats, area: Floats, curved: Bools, incident: Floats, scattered: Floats,
        wavenumber: Floats,
    ) -> Floats:  # fmt: skip
        """Power |f|^2 (frequency,) in m2 of unhidden facets, for unit vectors (xyz) of propagation, in and away.

        corners (facet, 3, xyz) m, counter-clockwise from outside, with normal (facet, xyz), area (facet,) m2 and
        whether the surface is curved there (facet,); wavenumber (frequency,) rad/m.
        """
        amplitude = self.amplitude(incident, scattered, normal, area)
        return np.full(wavenumber.shape, np.sum(amplitude**2))

    @property
    def parts(self) -> tuple[Component, ...]:
        """What an echo is made of, each a path of its own: here one, in the shape of the snap."""
        return (Lobe(self),)

    @property
    def coherent(self) -> bool:
        """Whether the echoes of facets add with their phases, and facets change the pulse."""
        return False

    @property
    def mesh_tolerance(self) -> float | None:
        """Error of the echo by which a mesh may miss its curved surface, of a law that sums phases; none: the mesh
        stays as it is described."""
        return None

    @property
    def longest_facet(self) -> float | None:
        """Longest facet (m) that may echo from its middle, of a law whose powers add by area: shapes that leave their
        edge out are cut so far. None: the number of facets counts, or facets add with their phases."""
        return None

    @property
    def passes_sound(self) -> bool:
        """Whether bodies let sound pass and send a wave of their own that cancels it behind them, by diffraction."""
        return False

    @property
    def rms_roughness(self) -> float:
        """Rms height (m) about the facets that spreads the pulse."""
        return 0.0

    @property
    def turns_phase(self) -> bool:
        """Whether the reflection coefficient has a phase, which changes the shape of the pulse."""
        return False

    def polarity(self, mesh: Mesh) -> Floats:
        """Sign (facet,) of the echo of each facet: random, and the same whenever the mesh is."""
        return random_polarity(mesh)

    def too_small(self, body: Scatterer) -> str | None:
        """One line if the body is too small against the wavelengths for this law, and by how many dB; None if not."""
        return None

    def validity(self, body: Scatterer) -> tuple[str, ...]:
        """Where this law does not hold for a body in a band, one line each: ka, facets against the wavelength, angles.

        `plan` says these, and the store has them (root attribute `validity`). As it stands: whether it makes power.
        """
        share = self.returned_share(float(np.median(body.mesh.area))) if len(body.mesh.faces) else 0.0
        if share > MOST_RETURNED:
            return (
                f"scatters {share:.2g} times the power that reaches a facet: no surface gives back more than it gets",
            )
        return ()

    def returned_share(self, area: float) -> float:
        """Power that a facet of an area (m2) scatters in all directions over what reaches it: 1 at most, but for how
        finely directions are; the median over angles of incidence, for narrow lobes fall between them. 0 of a law that
        has parts of its own, and no amplitude."""
        if type(self).amplitude is FacetLaw.amplitude:
            return 0.0
        height, turn = evenly_in(DIRECTIONS, 2).T
        away = direction(2.0 * np.pi * turn, np.arcsin(2.0 * height - 1.0))
        shares = []
        for angle in INCIDENCES:
            incident = np.broadcast_to([np.sin(angle), 0.0, -np.cos(angle)], away.shape)
            f = self.amplitude(incident, away, np.tile([0.0, 0.0, 1.0], (len(away), 1)), np.full(len(away), area))
            shares.append(4.0 * np.pi * np.mean(f**2) / (area * np.cos(angle)))
        return float(np.median(shares))
