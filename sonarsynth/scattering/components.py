"""The parts of an echo: what a law sends back with its phase, and what without, as paths of their own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from sonarsynth.conventions import Bools, Floats
from sonarsynth.description.method import returned
from sonarsynth.equations.scattering.facet_pulses import facet_response
from sonarsynth.equations.scattering.lobes import dot, lambert, lit_and_seen, slope_lobe
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.scattering.facet_geometry import FacetGeometry, PulseResponse
from sonarsynth.scattering.kirchhoff_surface import KirchhoffSurface, reflection
from sonarsynth.scattering.random_signs import random_polarity


class Component:
    """One part of the echo of a facet: `amplitude`, `pulses` and `polarity` are its own, the rest may stay as here.

    Directions are unit vectors of propagation (..., xyz) in the frame of the body, in and away.
    """

    needs_corners = True
    """Whether it needs more of a facet than normal and area."""
    turns = False
    """Whether the phase of its reflections differs from direction to direction."""

    def amplitude(self, incident: Floats, scattered: Floats, patch: FacetGeometry, wavenumber: Floats) -> Floats:
        """Far-field amplitude (...) in m at a wavenumber (...) (rad/m), but for `pulses`; of echoes never negative.

        0 where a facet is not lit, or, for an echo, not seen.
        """
        raise NotImplementedError(f"{type(self).__name__} has no amplitude")

    def pulses(self, incident: Floats, scattered: Floats, patch: FacetGeometry, sound_speed: Floats) -> PulseResponse:
        """What it makes of the pulse, for directions (path, xyz) and sound speeds (path,) in m/s: here nothing."""
        return PulseResponse.plain(len(incident))

    def polarity(self, mesh: Mesh) -> Floats:
        """Sign (facet,) of the echo of each facet: f is the amplitude times it. Here the amplitude has it."""
        return np.ones(len(mesh.faces))

    def past_limb(self) -> Component:
        """The same, going on where a facet is lit but not seen, for arrays of which some hydrophones see it and are
        told from those that do not; here there is nothing that ends."""
        return self

    def amplitudes_in(
        self, away: Floats, incident: Floats, scattered: Floats, patch: FacetGeometry, wavenumber: Floats
    ) -> Floats:
        """Amplitude (path, direction) in directions `away` (path, direction, xyz) other than `scattered` (path, xyz),
        at a wavenumber (path,)."""
        return self.amplitude(incident[:, None], away, patch.over(), wavenumber[:, None])

    def tapers(self, patch: FacetGeometry) -> Bools:
        """Where (facet,) the echo falls to 0 towards the limb of the body, rather than ending there."""
        return np.zeros(len(patch.area), bool)

    def phase(self, incident: Floats, scattered: Floats) -> Floats:
        """Phase (...) of the reflection coefficient in rad, which directions change where `turns`."""
        return np.zeros(np.broadcast_shapes(incident.shape, scattered.shape)[:-1])

    def spot(self, patch: FacetGeometry) -> Floats:
        """Where on its facet each echo comes from (facet, xyz) m, from the middle: here means over facets."""
        return np.zeros((len(patch.area), 3))


class PulseRepeating(Protocol):
    """A law that repeats the pulse: an amplitude, and a sign of each facet."""

    def amplitude(
        self, incident: Floats, scattered: Floats, normal: Floats, area: Floats, beyond: bool = False
    ) -> Floats:
        """Far-field amplitude (...) in m; `beyond` as `Lobe.beyond`."""
        ...

    def polarity(self, mesh: Mesh) -> Floats:
        """As `Component.polarity`."""
        ...


@dataclass(frozen=True)
class Lobe(Component):
    """A law that repeats the pulse."""

    law: PulseRepeating
    beyond: bool = False
    """Whether the amplitude goes on where a facet is lit but not seen."""
    needs_corners = False

    def amplitude(self, incident: Floats, scattered: Floats, patch: FacetGeometry, wavenumber: Floats) -> Floats:
        """As `Component.amplitude`: the same at all wavenumbers."""
        shape = np.broadcast_shapes(incident.shape[:-1], scattered.shape[:-1], patch.area.shape)
        amplitude = self.law.amplitude(incident, scattered, patch.normal, patch.area, self.beyond)
        return np.asarray(returned(self.law, "amplitude", amplitude, shape))

    def past_limb(self) -> Lobe:
        """As `Component.past_limb`."""
        return replace(self, beyond=True)

    def polarity(self, mesh: Mesh) -> Floats:
        """As the law says."""
        return self.law.polarity(mesh)


@dataclass(frozen=True)
class CoherentKirchhoff(Component):
    """The coherent part of a Kirchhoff facet: it mirrors as far as it is large, and the phases of facets add up.

    f = V (i k/4 pi) A n.(ks - ki) 2 exp[corners] exp(-g^2/2) (`equations.scattering.kirchhoff_integral`,
    `equations.scattering.roughness`).
    """

    law: KirchhoffSurface
    beyond: bool = False
    """As of `Lobe`; it may be below 0 there."""

    def amplitude(self, incident: Floats, scattered: Floats, patch: FacetGeometry, wavenumber: Floats) -> Floats:
        """As `Component.amplitude`: |V| k A n.(ks - ki)/(4 pi), by the factor `Kirchhoff.lit`."""
        if self.beyond:
            return self._beyond(incident, scattered, patch, wavenumber)
        across = dot(patch.normal, scattered - incident)
        lit = self.law.lit(incident, scattered, patch.normal, patch.curved)
        mirrored = np.abs(reflection(self.law, incident, scattered)) * np.sqrt(1.0 - self.law.diffuse)
        return np.where(lit > 0.0, lit * mirrored * wavenumber * patch.area * across / (4.0 * np.pi), 0.0)

    def _beyond(self, incident: Floats, scattered: Floats, patch: FacetGeometry, wavenumber: Floats) -> Floats:
        """The same, going on in n.ks past where facets are seen: of those that taper to 0 as an odd function, which is
        bounded; its bend there is least where it falls least steeply, and those that the snap grazes as well are
        faint."""
        inward, outward = np.maximum(-dot(patch.normal, incident), 0.0), dot(patch.normal, scattered)
        both = np.where(inward > 0.0, inward + np.abs(outward), 1.0)
        across = np.where(self.tapers(patch), 4.0 * inward * outward / both, inward + outward)
        mirrored = np.abs(reflection(self.law, incident, scattered)) * np.sqrt(1.0 - self.law.diffuse)
        return np.where(inward > 0.0, mirrored * wavenumber * patch.area * across / (4.0 * np.pi), 0.0)

    def pulses(self, incident: Floats, scattered: Floats, patch: FacetGeometry, sound_speed: Floats) -> PulseResponse:
        """As `Component.pulses`: differentiated, and a mean over the facet; blurred by roughness."""
        count, zero = len(incident), np.zeros(len(incident))
        corners = dot(patch.corners, (incident - scattered)[:, None, :]) / sound_speed[:, None]
        phase = self.phase(incident, scattered) + zero
        delay_std = self.law.roughness * np.abs(dot(patch.normal, scattered - incident)) / sound_speed
        return PulseResponse(np.ones(count, bool), corners, zero, zero, zero, phase, delay_std)

    def phase(self, incident: Floats, scattered: Floats) -> Floats:
        """As `Component.phase`."""
        return np.asarray(np.angle(reflection(self.law, incident, scattered)))

    def tapers(self, patch: FacetGeometry) -> Bools:
        """As `Component.tapers`: where the surface is curved."""
        return patch.curved

    @property
    def turns(self) -> bool:  # type: ignore[override]
        """As `Component.turns`."""
        return not isinstance(self.law.surface, str)

    def past_limb(self) -> CoherentKirchhoff:
        """As `Component.past_limb`."""
        return replace(self, beyond=True)


@dataclass(frozen=True)
class DiffuseKirchhoff(Component):
    """The incoherent part of a Kirchhoff facet: the lobe of the slopes and Lambert's floor
    (`equations.scattering.roughness`).

    It comes from one point of the facet, with one sign, both drawn once for each facet of a mesh.
    """

    law: KirchhoffSurface
    beyond: bool = False
    """As of `Lobe`."""

    def _powers(self, incident: Floats, scattered: Floats, patch: FacetGeometry) -> tuple[Floats, Floats]:
        """Cross-sections per area (...) (1/sr) of the lobe, where heights are large, and of the floor, which is below 0
        where a facet is not seen."""
        lit = lit_and_seen(incident, scattered, patch.normal, self.beyond)
        returned = np.where(lit, np.abs(reflection(self.law, incident, scattered)) ** 2, 0.0)
        lobe = slope_lobe(incident, scattered, patch.normal, self.law.slope) if self.law.roughness > 0 else 0.0
        floor = lambert(incident, scattered, patch.normal, self.law.diffuse)
        if self.beyond:
            floor -= lambert(incident, -scattered, patch.normal, self.law.diffuse)
        return np.asarray(returned * (1.0 - self.law.diffuse) * lobe), np.asarray(returned * floor)

    def amplitude(self, incident: Floats, scattered: Floats, patch: FacetGeometry, wavenumber: Floats) -> Floats:
        """As `Component.amplitude`: root of the area times lobe and floor."""
        lobe, floor = self._powers(incident, scattered, patch)
        return np.sqrt(patch.area * np.abs(lobe + floor))

    def past_limb(self) -> DiffuseKirchhoff:
        """As `Component.past_limb`."""
        return replace(self, beyond=True)

    def spot(self, patch: FacetGeometry) -> Floats:
        """As `Component.spot`: one point of each facet."""
        return patch.spot

    def amplitudes_in(
        self, away: Floats, incident: Floats, scattered: Floats, patch: FacetGeometry, wavenumber: Floats
    ) -> Floats:
        """As `Component.amplitudes_in`: low heights send more where they are seen more squarely, great ones do not."""
        if self.law.roughness == 0.0:
            return super().amplitudes_in(away, incident, scattered, patch, wavenumber)
        sent = self._sent(incident[:, None], away, patch.over(), wavenumber[:, None])
        base = self._sent(incident, scattered, patch, wavenumber)[:, None]
        both = (sent > 0.0) & (base > 0.0)
        gain = np.where(both, np.sqrt(np.divide(sent, base, out=np.ones_like(sent), where=both)), sent > 0.0)
        return np.asarray(self.amplitude(incident, scattered, patch, wavenumber)[:, None] * gain)

    def _sent(self, incident: Floats, scattered: Floats, patch: FacetGeometry, wavenumber: Floats) -> Floats:
        """Power (...) in m2 that is sent without phase in common."""
        lobe, floor = self._powers(incident, scattered, patch)
        g = wavenumber * self.law.roughness * dot(patch.normal, scattered - incident)
        return np.asarray(patch.area * np.abs(floor - lobe * np.expm1(-g * g)))

    def pulses(self, incident: Floats, scattered: Floats, patch: FacetGeometry, sound_speed: Floats) -> PulseResponse:
        """As `Component.pulses`: without the share of the power that is coherent still."""
        count, zero = len(incident), np.zeros(len(incident))
        lobe, floor = self._powers(incident, scattered, patch)
        share = np.minimum(lobe / np.where(lobe + floor > 0.0, lobe + floor, 1.0), 1.0)
        delay = self.law.roughness * np.abs(dot(patch.normal, scattered - incident)) / sound_speed
        late = dot(patch.spot, incident - scattered) / sound_speed
        return PulseResponse(np.zeros(count, bool), np.zeros((count, 3)), share, delay, late, zero, zero)

    def polarity(self, mesh: Mesh) -> Floats:
        """At random."""
        return random_polarity(mesh)


@dataclass(frozen=True)
class Shadow(Component):
    """The wave that makes the shadow behind lit facets, seen or not: what the textbook's factor holds besides the echo.

    f = (i k/4 pi) A n.(ki + ks) 2 exp[corners], whatever the surface is made of and however rough it is: -i k/2 pi
    times the outline's area straight ahead, where it and the direct wave cancel; 0 at backscatter and in the mirror
    direction. So either the direct wave and this, over all lit facets, or echoes alone and no direct wave through the
    body; never both. Not reciprocal off the axis.
    """

    def amplitude(self, incident: Floats, scattered: Floats, patch: FacetGeometry, wavenumber: Floats) -> Floats:
        """As `Component.amplitude`, but k A n.(ki + ks)/(4 pi) with its sign: below 0 ahead, 0 where an echo is
        mirrored."""
        across = dot(patch.normal, incident + scattered)
        return np.where(dot(incident, patch.normal) < 0.0, wavenumber * patch.area * across / (4.0 * np.pi), 0.0)

    def pulses(self, incident: Floats, scattered: Floats, patch: FacetGeometry, sound_speed: Floats) -> PulseResponse:
        """As `Component.pulses`: differentiated, and a mean over the facet."""
        count, zero = len(incident), np.zeros(len(incident))
        corners = dot(patch.corners, (incident - scattered)[:, None, :]) / sound_speed[:, None]
        return PulseResponse(np.ones(count, bool), corners, zero, zero, zero, zero, zero)


def size_at(
    components: tuple[Component, ...],
    incident: Floats,
    scattered: Floats,
    patch: FacetGeometry,
    frequency: float,
    sound_speed: Floats,
) -> Floats:
    """|f| (path,) in m of facets at a frequency (Hz): powers of the components summed.

    Directions (path, xyz) in the frame of the body; sound_speed (path,) in m/s at the facets.
    """
    power = np.zeros(len(incident))
    for component in components:
        pulse = component.pulses(incident, scattered, patch, sound_speed)
        amplitude = component.amplitude(incident, scattered, patch, 2.0 * np.pi * frequency / sound_speed)
        rough = pulse.coherent_fraction, pulse.height_delay_std
        response = facet_response(np.array([frequency]), pulse.coherent, pulse.corner_delays, *rough, frequency)[:, 0]
        power += np.abs(amplitude * response * np.exp(-0.5 * (2.0 * np.pi * frequency * pulse.delay_std) ** 2)) ** 2
    return np.sqrt(power)
