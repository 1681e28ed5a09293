"""Echoes by one part of the law of one body, in the frame of the body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.columns import Columns, picked, rows_of
from sonarsynth.conventions import Bools, Floats, Ints, depth
from sonarsynth.description.method import returned
from sonarsynth.scattering import Component, Scatterers
from sonarsynth.scattering.facet_geometry import FacetGeometry, PulseResponse
from sonarsynth.tracing.doppler import MotionTerms
from sonarsynth.tracing.receive_paths import DOUBTFUL
from sonarsynth.tracing.transmit_paths import TransmitPaths

if TYPE_CHECKING:
    from sonarsynth.tracing.facet_paths import FacetPaths

PRUNE_MARGIN = 1e-3
"""Of what is negligible: fainter echoes are not held while others are looked at."""


@dataclass(frozen=True, eq=False)
class EchoBatch(Columns):
    """Echoes by one part of the law of one owner, in its frame."""

    surface: Scatterers
    part: Component
    row: Ints  # (echo,) which pair of a way and a leg
    patch: FacetGeometry  # (echo,)
    incident: Floats  # (echo, xyz)
    scattered: Floats  # (echo, xyz)
    wavenumber: Floats  # (echo,) rad/m at the centre of the band
    amplitude: Floats  # (echo,) m
    sign: Floats  # (echo,)

    def over(self, away: Floats) -> Floats:
        """Amplitudes (echo, probe) in directions (echo, probe, xyz)."""
        return self.part.amplitudes_in(away, self.incident, self.scattered, self.patch, self.wavenumber)

    @property
    def tapered(self) -> Bools:
        """(echo,) whether it falls to 0 at the limb of the body, rather than ending there."""
        return self.part.tapers(self.patch)

    def turned(self, away: Floats) -> Floats:
        """Phase (echo, probe) in directions (echo, probe, xyz) more than in that of the array centre."""
        if not self.part.turns:
            return np.zeros(away.shape[:2])
        seen_from_centre = self.part.phase(self.incident, self.scattered)[:, None]
        more = self.part.phase(self.incident[:, None, :], away) - seen_from_centre
        return np.asarray(more - 2.0 * np.pi * np.rint(more / (2.0 * np.pi)))

    @property
    def spot(self) -> Floats:
        """Where on its facet each echo comes from (echo, xyz) m, world, from the middle; 0 of means over facets."""
        spot = self.part.spot(self.patch)
        return self.surface.pose.turn_to_world(spot) if spot.any() else spot

    def pulses(self, centre: float) -> PulseResponse:
        """What they make of the pulse; centre (Hz)."""
        sound_speed = 2.0 * np.pi * centre / self.wavenumber
        return self.part.pulses(self.incident, self.scattered, self.patch, sound_speed)


def echo_batches(
    array: FacetPaths, out: TransmitPaths, leg: Ints, components: tuple[tuple[Component, ...], ...],
    carried: MotionTerms | None, factor: Floats,
) -> list[EchoBatch]:  # fmt: skip
    """Echoes of pairs of a way and a leg (pair,), by owner and part; carried: by how much pairs differ from those that
    were traced, where anything moves; factor (pair,): what ways do to amplitudes.

    Those that are nothing are left out, and those that all together are much fainter than what is pruned.
    """
    facets, context, receiver, batches = array.facets, array.context, array.context.receiver, []
    looked_for = context.tolerances.occlusion == "sensors" and receiver.elements.count > 1
    owner = facets.owner[out.facet]
    for number, (surface, of_law) in enumerate(zip(context.scattering, components, strict=True)):
        owned = picked(owner == number)
        row, owned_leg, facet = np.arange(len(owner))[owned], leg[owned], facets.facet[out.facet[owned]]
        arrival, departure = rows_of(out.arrival, owned), rows_of(array.legs.departure, owned_leg)
        if carried is None:
            incident, scattered = surface.pose.turn_to_body(arrival), surface.pose.turn_to_body(departure)
        else:
            motion, length = carried.select(owned), array.legs.length[owned_leg]
            incident = motion.arrival(arrival, surface.pose)
            scattered = motion.departure(length, departure, surface.pose)
        speed = context.medium.profile.at(depth(array.legs.point[owned_leg]))
        wavenumber = 2.0 * np.pi * receiver.centre / speed
        for component in (part.past_limb() if looked_for else part for part in of_law):
            patch = surface.geometry(component.needs_corners).select(facet)
            amplitude = component.amplitude(incident, scattered, patch, wavenumber)
            returned(component, "amplitude", amplitude, row.shape)
            sign = surface.polarity(component)[facet]
            batch = EchoBatch(surface, component, row, patch, incident, scattered, wavenumber, amplitude, sign)
            strength = np.abs(amplitude) * factor[row]
            faint = np.sqrt(PRUNE_MARGIN * context.tolerances.negligible) / max(len(row), 1)
            heard = array.legs.open[owned_leg] < DOUBTFUL
            batches.append(batch.select(picked(strength > faint * strength[heard].max(initial=0.0))))
    return batches


def in_band(pulses: PulseResponse, band: tuple[float, float]) -> Floats:
    """What roughness leaves of each pulse (path,) at most, at any frequency of the band (Hz)."""
    if not (pulses.delay_std.any() or pulses.coherent_fraction.any()):
        return np.ones(len(pulses.delay_std))
    low, high = (2.0 * np.pi * f for f in band)
    rough = np.sqrt(1.0 - pulses.coherent_fraction * np.exp(-((high * pulses.height_delay_std) ** 2)))
    return np.asarray(np.exp(-0.5 * (low * pulses.delay_std) ** 2) * rough)
