"""The thesis's coefficient: a lobe around the mirror direction, made a scattering law that conserves energy."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Gt, Le
from pydantic import ValidationInfo, field_validator

from sonarsynth.acoustics.lobes import lambert, lit_and_seen, slope_lobe, slope_of_width
from sonarsynth.conventions import Floats, Number, Radians
from sonarsynth.description import description


@description
class MirrorLobe:
    """Sound leaves a facet in a lobe around the mirror direction; the smoother the surface, the narrower the lobe.

    |f|^2 = area (reflectivity^2 sigma0 + diffuse floor): powers add by area, so splitting a facet changes no sum of
    them.
    """

    kind: Literal["mirror_lobe"] = "mirror_lobe"
    width: Annotated[Radians, Gt(0), Le(1.0)] = np.deg2rad(20.0)
    """Standard deviation of the amplitude lobe exp(-delta^2/(2 width^2)), delta the angle off the mirror direction."""
    reflectivity: Annotated[Number, Ge(0), Le(1)] = 1.0
    """Pressure reflection coefficient of the surface."""
    diffuse: Annotated[Number, Ge(0), Le(1)] = 0.0
    """Share of the power that is scattered by Lambert's law; with reflectivity squared at most 1."""

    @field_validator("diffuse")
    @classmethod
    def _check_energy(cls, value: float, info: ValidationInfo) -> float:
        reflectivity = info.data.get("reflectivity", 0.0)
        if value + reflectivity**2 > 1.0:
            raise ValueError(
                f"with reflectivity {reflectivity:g} scatters more power than arrives: at most {1 - reflectivity**2:g}"
            )
        return value

    def amplitude(self, incident: Floats, scattered: Floats, normal: Floats, area: Floats) -> Floats:
        """Far-field scattering amplitude (...) in m; arguments as in `ScatteringLaw`."""
        power = self.reflectivity**2 * slope_lobe(incident, scattered, normal, float(slope_of_width(self.width)))
        if self.diffuse > 0:
            power = power + lambert(incident, scattered, normal, self.diffuse)
        return np.where(lit_and_seen(incident, scattered, normal), np.sqrt(area * power), 0.0)
