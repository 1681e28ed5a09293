"""The same amplitude in every direction: a point scatterer, for tests and calibration."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from annotated_types import Gt

from sonarsynth.conventions import Floats, Metres
from sonarsynth.description import description
from sonarsynth.equations.scattering.lobes import lit_and_seen
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.scattering.facet_law import FacetLaw
from sonarsynth.scattering.law_validity import Scatterer, facets_note


@description
class Isotropic(FacetLaw):
    """Every facet that is lit and seen scatters alike, whatever its area."""

    kind: Literal["isotropic"] = "isotropic"
    strength: Annotated[Metres, Gt(0)] = 1.0
    """Scattering amplitude of a facet (m): a target strength of 20 log10 of it."""

    def validity(self, body: Scatterer) -> tuple[str, ...]:
        """As `FacetLaw.validity`: it is the echo of no body, whatever ka and angle."""
        level, count = 20.0 * np.log10(self.strength), len(body.mesh.faces)
        level_note = (
            f"each of {count} facets echoes by {level:.3g} dB re 1 m2, whatever its area, ka and angle: that is for "
            "calibration, and not the level of a body"
        )
        notes = level_note, facets_note(body)
        return tuple(note for note in notes if note)

    def amplitude(
        self, incident: Floats, scattered: Floats, normal: Floats, area: Floats, beyond: bool = False
    ) -> Floats:
        """Far-field scattering amplitude (...) in m, directions in and away; `beyond`: as in `components.Lobe`."""
        return np.where(lit_and_seen(incident, scattered, normal, beyond), self.strength, 0.0)

    def polarity(self, mesh: Mesh) -> Floats:
        """Sign (facet,) of the echo of each facet: all alike."""
        return np.ones(len(mesh.faces))
