"""Sound on its way: rays between points, and all paths of a frame as they reach the array."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sonarsynth.conventions import Bools, Bytes, Floats, Ints


@dataclass(frozen=True, eq=False)
class Paths:
    """Rays that join pairs of points in the water, from a propagation model. World frame.

    A pair may have no path (a shadow zone) or several; paths are sorted by pair, then by travel time.
    """

    pair: Ints  # (path,) which pair of end points
    travel_time: Floats  # (path,) s
    length: Floats  # (path,) m, along the ray
    departure: Floats  # (path, xyz) unit vector of travel where the ray starts
    arrival: Floats  # (path, xyz) unit vector of travel where it ends
    spreading: Floats  # (path,) 1/m: geometric amplitude re 1 m from the source (1/r in isovelocity water)
    surface: Ints  # (path,) number of surface reflections
    bottom: Ints  # (path,) number of bottom reflections
    turning: Ints  # (path,) number of turning points
    caustics: Ints  # (path,) caustics passed
    surface_grazing: Floats  # (path,) rad: grazing angle at the surface; NaN without a reflection there
    bottom_grazing: Floats  # (path,) rad: grazing angle at the bottom; NaN without a reflection there
    flag: Ints  # (path,) 0 good; else why ray theory ends here (`ray_solutions.REASONS`)


DIRECT = "direct"
FAMILIES = (DIRECT, "surface", "bottom", "surface and bottom")
"""Families of paths: by which boundaries they touched."""


@dataclass(frozen=True, eq=False)
class Arrivals:
    """Every path of a frame as it reaches the array: snap to facet to array, and snap to array.

    The wavefront of path e reaches sensor position q (sonar frame) at
        delay[e] + (|R d - q| - |R|)/sound_speed + delay_terms[e] @ aperture_terms(q)
    with d = direction[e], R = radius[e], and amplitude
        amplitude[e] * R/|R d - q| * (1 + amplitude_terms[e] @ aperture_terms(q)).
    (`apertures.aperture_terms`.) Water absorbs on what the way is longer by, its delay times sound_speed, as it does on
    the way to the array centre: synthesis takes that off at each frequency. In isovelocity water the sphere is exact
    and delay_terms has no columns. Reflections on the way differ over the aperture: there the phase is phase[e] +
    phase_terms[e] @ aperture_terms(q), at every frequency, and the variance of the delay is delay_std[e]^2 +
    delay_variance_terms[e] @ aperture_terms(q), which may be below 0: the delays over a facet, whose mean
    `corner_delays` is that at the centre, have another variance there, and heights of a rough facet, of which the
    centre's `height_delay_std` tells, another echo: what delay_std and amplitude together nearly say over the band.
    What moves is seen from another side there: the Doppler factor is doppler[e] + doppler_terms[e] @ aperture_terms(q).
    amplitude is the factor on the pressure waveform of the snap at 1 m: the product of the columns below it. Facets
    change the waveform: its spectrum is multiplied by `facet_pulses.facet_response` of coherent, corner_delays,
    coherent_fraction and height_delay_std, whose modulus is 1 at `centre` for a coherent facet that is small.
    """

    delay: Floats  # (path,) s at the array centre, snap time included
    direction: Floats  # (path, xyz) unit vector from the array centre towards where the path seems to come from
    radius: Floats  # (path,) m: radius of curvature of the reference sphere
    delay_terms: Floats  # (path, term) s; (path, 0) where the sphere is exact
    amplitude_terms: Floats  # (path, term); (path, 0) where R/|R d - q| is exact
    phase_terms: Floats  # (path, term) rad; (path, 0) where all hydrophones have the phase of the centre
    delay_variance_terms: Floats  # (path, term) s2; (path, 0) where all have that of the centre
    amplitude: Floats  # (path,) signed: spreading_out * scattering * spreading_in * boundary * 10^(-absorption/20)
    spreading_out: Floats  # (path,) 1/m: snap to facet (snap to array for the direct path)
    spreading_in: Floats  # (path,) 1/m: facet to array (1 for the direct path)
    scattering: Floats  # (path,) m, signed: far-field amplitude f of the facet (1 for the direct path)
    boundary: Floats  # (path,) product of the moduli of reflection coefficients, and -1 for a phase of pi
    absorption: Floats  # (path,) dB along the whole path at the centre of the band
    length: Floats  # (path,) m: whole path
    snap: Ints  # (path,) index of the snap
    target: Ints  # (path,) index of the target, -1 for the direct path
    facet: Ints  # (path,) index of the facet in its target's mesh, -1 for the direct path
    point: Floats  # (path, xyz) m, world: scattering point where the sound met it (direct path: the snap)
    surface: Ints  # (path,) surface reflections
    bottom: Ints  # (path,) bottom reflections
    turning: Ints  # (path,) turning points
    caustics: Ints  # (path,) caustics passed
    lit_by: Ints  # (path,) index into FAMILIES: which boundaries it touched first, on its way to the target
    arrives_by: Ints  # (path,) index into FAMILIES: which boundaries it touched last, on its way to the array
    phase: Floats  # (path,) rad: constant phase of the pulse over frequency, from caustics and lossy reflections
    delay_std: Floats  # (path,) s: roughness takes exp(-(2 pi f delay_std)^2/2) off the spectrum, a Gaussian in time
    echo_delay_std: Floats  # (path,) s: the facet's part of delay_std; the squares of both parts add up
    doppler: Floats  # (path,) Doppler: the pulse is p((t - delay)/(1 + doppler))
    doppler_terms: Floats  # (path, term); (path, 0) where all hydrophones have the Doppler of the centre
    coherent: Bools  # (path,) of a smooth facet, or its shadow: differentiated, i f/centre; phases count in sums
    corner_delays: Floats  # (path, 3) s: of the facet about `delay`, a mean over it; 0: a point
    coherent_fraction: Floats  # (path,) w: of the power that is coherent where it is smooth
    height_delay_std: Floats  # (path,) s: a rough facet sends sqrt(1 - w exp(-(2 pi f height_delay_std)^2)); w = 0: all
    occluded: Bytes  # (path, byte) bits: a body hides it from the array centre, from each hydrophone; (path, 0): none
    centre: float  # Hz: centre of the band, where amplitudes hold
    sound_speed: float  # m/s of the water at the array centre
    wavefront_error: float  # s: largest error of the wavefronts that was measured, at probes spread over the aperture
    amplitude_error: float = 0.0  # largest error of the amplitudes measured there, relative to the strongest echo

    def select(self, keep: Bools | Ints) -> Arrivals:
        """The arrivals picked by a mask or by indices (path,)."""
        rows: dict[str, Any] = {
            name: value[keep] if isinstance(value, np.ndarray) else value for name, value in vars(self).items()
        }
        return Arrivals(**rows)

    def hidden(self, sensors: int) -> Bools:
        """(path, sensor) hydrophones that a body hides each path from; (path, 0) where none is hidden anywhere."""
        bits = np.unpackbits(self.occluded, axis=1, count=1 + sensors if self.occluded.shape[1] else None)
        return bits[:, 1:].astype(bool)

    def for_sensors(self, rows: Ints, sensors: int) -> Arrivals:
        """The same for some (row,) of so many hydrophones, in another order perhaps."""
        if not self.occluded.shape[1]:
            return self
        bits = np.unpackbits(self.occluded, axis=1, count=1 + sensors)
        return replace(self, occluded=np.packbits(bits[:, np.append(0, 1 + rows)], axis=1))

    @property
    def seen_from_centre(self) -> Arrivals:
        """The paths that reach the centre of the array, as if all hydrophones saw what it sees."""
        if not self.occluded.shape[1]:
            return self
        seen = self.select(self.occluded[:, 0] < 128)
        return replace(seen, occluded=seen.occluded[:, :0])

    @property
    def direct(self) -> Bools:
        """(path,) true for paths that met no target."""
        return self.target < 0
