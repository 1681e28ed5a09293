"""The Kirchhoff integral as a law: each flat facet scatters coherently, as its plane-wave coefficient says."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Gt, Le

from sonarsynth.conventions import Bools, Floats, NonNegativeMetres, Number
from sonarsynth.description import description
from sonarsynth.equations.scattering.kirchhoff_integral import shadow_taper
from sonarsynth.equations.scattering.lobes import lit_and_seen
from sonarsynth.equations.scattering.roughness import incoherent_power, roughness_parameter
from sonarsynth.scattering.components import CoherentKirchhoff, Component, DiffuseKirchhoff
from sonarsynth.scattering.facet_law import FacetLaw
from sonarsynth.scattering.kirchhoff_surface import PartlyReflecting, reflection
from sonarsynth.scattering.law_notes import concave_note
from sonarsynth.scattering.law_validity import NEAR, Scatterer, aside_note, lit_half, size_note, slopes_note


@description
class Kirchhoff(FacetLaw):
    """Facets scatter as pieces of plane mirrors, exact for each of them, and add with their phases.

    |f|^2 = |sum of facets exp(-g^2/2)|^2 + sum of area times the lobe of the slopes, the second for rough surfaces.
    Good where the body is large against the wavelength; no second bounce. Only echoes: no waves that creep round the
    body, and what cancels the direct wave in the shadow behind it is left out, unless `forward` says otherwise. Where
    the lit and seen part ends, the echo of a curved surface is tapered to 0 and that of a flat one ends.
    Rigid spheres of 0.25 m, 25 to 110 kHz, against the exact series: within 0.3 dB at backscatter, 0.7 dB at 90 and 105
    degrees off it, 2.5 dB at 120.
    """

    kind: Literal["kirchhoff"] = "kirchhoff"
    surface: Literal["rigid", "soft"] | PartlyReflecting = "rigid"
    """Reflection coefficient 1, -1, or by density and sound speed."""
    roughness: NonNegativeMetres = 0.0
    """Rms height of the surface about the facets."""
    slope: Annotated[Number, Gt(0), Le(0.5)] = 0.1
    """Rms slope per axis of a rough surface: how wide the incoherent part spreads. Nothing where roughness is 0.
    The lobe knows no shadows of its heights: 0.1 gives back 0.95 to 0.99 of the power, 0.2 up to 1.09 and 0.5 up to
    1.46 of it at 75 degrees incidence."""
    diffuse: Annotated[Number, Ge(0), Le(1)] = 0.0
    """Share of the returned power that is scattered by Lambert's law instead."""
    forward: Literal["blocked", "scattered"] = "blocked"
    """What happens, in frames, to a snap that would have to pass the body to be heard. Blocked: it is not heard where
    the body stands before the array centre. Scattered: it is heard, and each facet that it lights sends its part of the
    wave that makes the shadow, which cancels it behind the body, but for what bends round the edge, and changes it
    beside the body. Echoes of other bodies are blocked in both cases. Rigid spheres of 0.25 and 0.5 m, 10 m off, 25 to
    85 kHz, against the exact series: the whole field is within 1.2 and 2.3 dB in the shadow (soft: 1.8 and 4.1 dB), and
    within 0.6 dB from one and a half times its width on. Snap and array must be many wavelengths off the body."""
    mesh_error: Annotated[Number, Ge(0.005), Le(1)] = 0.05
    """In frames, shapes are meshed as finely as makes the expected error of the echo this (0.05: 0.4 dB)."""

    @property
    def mesh_tolerance(self) -> float:
        """As `FacetLaw.mesh_tolerance`."""
        return self.mesh_error

    @property
    def passes_sound(self) -> bool:
        """As `FacetLaw.passes_sound`."""
        return self.forward == "scattered"

    @property
    def parts(self) -> tuple[Component, ...]:
        """Of an echo: the coherent one, and what a rough or diffuse surface scatters."""
        rough = self.roughness > 0 or self.diffuse > 0
        return (
            *((CoherentKirchhoff(self),) if self.diffuse < 1 else ()),
            *((DiffuseKirchhoff(self),) if rough else ()),
        )

    @property
    def coherent(self) -> bool:
        """True, but for what a rough surface scatters."""
        return True

    @property
    def rms_roughness(self) -> float:
        """Rms height (m) of the surface about the facets."""
        return self.roughness

    @property
    def turns_phase(self) -> bool:
        """Of surfaces that sound enters."""
        return isinstance(self.surface, PartlyReflecting)

    def too_small(self, body: Scatterer) -> str | None:
        """As `FacetLaw.too_small`."""
        return size_note(body, lit_half, "Kirchhoff's integral", "soft" if self.surface == "soft" else "rigid")

    def validity(self, body: Scatterer) -> tuple[str, ...]:
        """As `FacetLaw.validity`; how fine its facets are is for the mesh to say
        (`mesh_resolution.frame_mesh`)."""
        near = (
            f"nearer than {NEAR * body.aperture:.2g} m, where the echo may be some per cent off at the rim of the "
            "array: facets have one direction to all hydrophones (shape.edge: a quarter wavelength helps)"
        )
        notes = [self.too_small(body), concave_note(body.mesh), slopes_note(self.roughness, self.slope, body)]
        if self.forward == "blocked":
            notes.append(aside_note(body))
        if body.distance < NEAR * body.aperture:
            notes.append(near)
        return tuple(note for note in notes if note)

    def reflection(self, incident: Floats, scattered: Floats) -> complex:
        """Plane-wave coefficient of the facets that would mirror one unit vector (xyz) of propagation into the other.

        It stands for that of all facets, which keeps the law reciprocal.
        """
        return complex(reflection(self, incident, scattered))

    def lit(self, incident: Floats, scattered: Floats, normal: Floats, curved: Bools) -> Floats:
        """Factor (facet,) on the amplitude of facets with normals (facet, xyz), 0 where a facet is not lit or not seen.

        curved (facet,): whether the surface goes on in a curve there, so that the echo is tapered to 0 where the lit
        and seen part ends; facets in a plane with their neighbours end in an edge, as a plate does.
        """
        sharp = np.where(lit_and_seen(incident, scattered, normal), 1.0, 0.0)
        return np.where(curved, shadow_taper(incident, scattered, normal), sharp)

    def cross_section(
        self, corners: Floats, normal: Floats, area: Floats, curved: Bools, incident: Floats, scattered: Floats,
        wavenumber: Floats,
    ) -> Floats:  # fmt: skip
        """As `FacetLaw.cross_section`."""
        from sonarsynth.equations.scattering.kirchhoff_kernels import mesh_amplitude

        coefficient = self.reflection(incident, scattered)
        factor = self.lit(incident, scattered, normal, curved)
        smooth = coefficient * np.sqrt(1.0 - self.diffuse)
        amplitude = mesh_amplitude(corners, incident, scattered, wavenumber, smooth * factor, self.roughness)
        power = np.abs(amplitude) ** 2
        if self.roughness > 0 or self.diffuse > 0:
            on = np.flatnonzero(factor > 0)
            g = roughness_parameter(wavenumber[:, None], self.roughness, incident, scattered, normal[on])
            albedo = np.abs(coefficient) ** 2 * self.diffuse
            power = power + incoherent_power(g, incident, scattered, normal[on], self.slope, smooth, albedo) @ area[on]
        return np.asarray(power)
