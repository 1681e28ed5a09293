"""Results in flight: frozen dataclasses of arrays, shapes in the annotations. The stages meet only here.

Axes: path (an arrival), sensor, sample, snap, target, elevation, azimuth, xyz, term (polynomial over the aperture).
Unless said otherwise arrays are float64, positions in m in the sonar frame, times in s on the clock of the frame (0 is
the instant of the frame; a snap at `Snap.time` is heard a travel time later).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

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
    bottom: Ints  # (path,) number of bed reflections
    turning: Ints  # (path,) number of turning points
    caustics: Ints  # (path,) caustics passed
    surface_grazing: Floats  # (path,) rad: grazing angle at the surface; NaN without a reflection there
    bottom_grazing: Floats  # (path,) rad: grazing angle at the bed; NaN without a reflection there
    flag: Ints  # (path,) 0 good; else why ray theory ends here (`acoustics.rays.REASONS`)


FAMILIES = ("direct", "surface", "bed", "surface and bed")
"""Families of paths: by which boundaries they touched."""


@dataclass(frozen=True, eq=False)
class Arrivals:
    """Every path of a frame as it reaches the array: snap to facet to array, and snap to array.

    The wavefront of path e reaches sensor position q (sonar frame) at
        delay[e] + (|R d - q| - |R|)/sound_speed + delay_terms[e] @ aperture_terms(q)
    with d = direction[e], R = radius[e], and amplitude
        amplitude[e] * R/|R d - q| * (1 + amplitude_terms[e] @ aperture_terms(q)).
    (`acoustics.arrays.aperture_terms`.) Water absorbs on what the way is longer by, its delay times sound_speed, as it
    does on the way to the array centre: synthesis takes that off at each frequency. In isovelocity water the sphere is
    exact and delay_terms has no columns. Reflections on the way differ over the aperture: there the phase is phase[e] +
    phase_terms[e] @ aperture_terms(q), at every frequency, and the square of the blur is blur[e]^2 + blur_terms[e] @
    aperture_terms(q), which may be below 0: the delays over a facet, whose mean `corners` is that at the centre, have
    another variance there, and heights of a rough facet, of which the centre's `rough_delay` tells, another echo: what
    blur and amplitude together nearly say over the band. What moves is seen from another side there: the stretch is
    stretch[e] + stretch_terms[e] @ aperture_terms(q).
    amplitude is the factor on the pressure waveform of the snap at 1 m: the product of the columns below it. Facets
    change the waveform: its spectrum is multiplied by `acoustics.facet_pulses.facet_response` of
    coherent, corners, rough_share and rough_delay, whose modulus is 1 at `centre` for a coherent facet that is small.
    """

    delay: Floats  # (path,) s at the array centre, snap time included
    direction: Floats  # (path, xyz) unit vector from the array centre towards where the path seems to come from
    radius: Floats  # (path,) m: radius of curvature of the reference sphere
    delay_terms: Floats  # (path, term) s; (path, 0) where the sphere is exact
    amplitude_terms: Floats  # (path, term); (path, 0) where R/|R d - q| is exact
    phase_terms: Floats  # (path, term) rad; (path, 0) where all hydrophones have the phase of the centre
    blur_terms: Floats  # (path, term) s2; (path, 0) where all have the blur of the centre
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
    bottom: Ints  # (path,) bed reflections
    turning: Ints  # (path,) turning points
    caustics: Ints  # (path,) caustics passed
    arrives_by: Ints  # (path,) index into FAMILIES: which boundaries it touched last, on its way to the array
    phase: Floats  # (path,) rad: constant phase of the pulse over frequency, from caustics and lossy reflections
    blur: Floats  # (path,) s: roughness takes exp(-(2 pi f blur)^2/2) off the spectrum, a Gaussian in time
    echo_blur: Floats  # (path,) s: the part of blur that is the facet's, blur^2 the sum of its square and boundaries'
    stretch: Floats  # (path,) Doppler: the pulse is p((t - delay)/(1 + stretch))
    stretch_terms: Floats  # (path, term); (path, 0) where all hydrophones have the Doppler of the centre
    coherent: Bools  # (path,) of a smooth facet, or its shadow: differentiated, i f/centre; phases count in sums
    corners: Floats  # (path, 3) s: of the facet about `delay`, a mean over it; 0: a point
    rough_share: Floats  # (path,) w: of the power that is coherent where it is smooth
    rough_delay: Floats  # (path,) s: a rough facet sends sqrt(1 - w exp(-(2 pi f rough_delay)^2)); w = 0: all
    hidden_from: (
        Bytes  # (path, byte) bits: a body hides it from the array centre, from each hydrophone; (path, 0): none
    )
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
        bits = np.unpackbits(self.hidden_from, axis=1, count=1 + sensors if self.hidden_from.shape[1] else None)
        return bits[:, 1:].astype(bool)

    def heard_by(self, rows: Ints, sensors: int) -> Arrivals:
        """The same for some (row,) of so many hydrophones, in another order perhaps."""
        if not self.hidden_from.shape[1]:
            return self
        bits = np.unpackbits(self.hidden_from, axis=1, count=1 + sensors)
        return replace(self, hidden_from=np.packbits(bits[:, np.append(0, 1 + rows)], axis=1))

    @property
    def at_centre(self) -> Arrivals:
        """The paths that reach the centre of the array, as if all hydrophones saw what it sees."""
        if not self.hidden_from.shape[1]:
            return self
        seen = self.select(self.hidden_from[:, 0] < 128)
        return replace(seen, hidden_from=seen.hidden_from[:, :0])

    @property
    def direct(self) -> Bools:
        """(path,) true for paths that met no target."""
        return self.target < 0


@dataclass(frozen=True, eq=False)
class Signals:
    """Pressure at each hydrophone, as the converter gives it."""

    pressure: npt.NDArray[
        np.float32
    ]  # (sensor, sample) Pa; as converted, a whole number of `quantum` where there is one
    start: float  # s: time of sample 0
    sampling_frequency: float  # Hz
    quantum: float  # Pa of one count; 0 without a converter
    clipped: int  # samples at full scale
    outside: int  # arrivals that fell outside the window: counted, never wrapped


REASONS = (
    "accepted",
    "nothing_heard",
    "array_tells_no_direction",
    "band_too_narrow",
    "not_one_wavefront",
    "not_resolved",
    "outside_the_water",
    "may_be_an_echo",
    "range_unknown",
)
"""Why a row of `Bearings` is not accepted: `Bearings.reason` is an index. Of "range_unknown" the position alone is NaN:
when and from where the pulse came is known; of all others nothing."""


@dataclass(frozen=True, eq=False)
class Bearings:
    """Where the array hears each snap: one row a snap, the loudest direct pulse first; NaN where none was found.

    Rows of what was found come first, then those of pulses that were refused, `reason` says why. Standard errors are
    predicted from the data and the instrument alone (one sigma). Which true snap a row comes from is a label:
    `labelling.estimates`.
    """

    time: Floats  # (snap,) s: arrival at the array centre of the peak of the pulse's envelope in the band
    time_error: Floats  # (snap,) s
    azimuth: Floats  # (snap,) rad, sonar frame, of the arriving wave as it is heard, whatever else is known
    azimuth_error: Floats  # (snap,) rad
    elevation: Floats  # (snap,) rad
    elevation_error: Floats  # (snap,) rad
    range_from_depth: Floats  # (snap,) m: where the bearing meets the known depth of the bed
    range_from_depth_error: Floats  # (snap,) m
    range_from_curvature: Floats  # (snap,) m: from the curvature of the wavefront
    range_from_curvature_error: Floats  # (snap,) m
    position: Floats  # (snap, xyz) m, sonar frame: of the wavefront, and of the bottom's depth where it was used
    position_covariance: Floats  # (snap, xyz, xyz) m2
    residual: Floats  # (snap,) s: root mean square residual of the sensor delays
    bottom_used: (
        Ints  # (snap,) 1 where the depth of the bottom entered the position, 0 where it did not, -1 without one
    )
    reason: Ints  # (snap,) index into REASONS


@dataclass(frozen=True, eq=False)
class EnergyImage:
    """Energy in each steered direction, in the echo window."""

    energy: npt.NDArray[np.float32]  # (elevation, azimuth) Pa2 s: a plane wave of pressure p gives int p2 dt
    azimuth: Floats  # (azimuth,) rad, ascending
    elevation: Floats  # (elevation,) rad, ascending
    start: float  # s: the echo window that was imaged
    stop: float  # s
    remainder: float = float("nan")  # share of the loudest beam that may be left of the direct pulse, once taken out


@dataclass(frozen=True, eq=False)
class PointCloud:
    """One organised cloud on the beam grid; NaN where there is no point. Sonar frame."""

    range: npt.NDArray[np.float32]  # (elevation, azimuth) m from the array centre
    range_error: npt.NDArray[np.float32]  # (elevation, azimuth) m, predicted standard error
    delay: npt.NDArray[np.float32]  # (elevation, azimuth) s after the direct arrival
    energy: npt.NDArray[np.float32]  # (elevation, azimuth) Pa2 s of the beam
    position: npt.NDArray[np.float32]  # (elevation, azimuth, xyz) m


ORIGINS = ("main lobe", "side lobe", "grating lobe", "mirror image", "snap itself", "unexplained")
"""How the array came to hear what made a point: in the beam, beside it, through a lobe that a lattice has in other
directions, from behind a planar array, from no target but the snap (its direct pulse, or one that surface or bed
reflects), or from no path of the frame: noise, or what cancelling leaves."""


@dataclass(frozen=True, eq=False)
class PointLabels:
    """Whose echo each point is: the target, snap and family whose paths bring most energy in the beam at its delay.

    -1 and NaN where there is no point, or nothing explains it. The emission of a point is not that of the sonar's clock
    where another snap lit it: its range is wrong then.
    """

    target: npt.NDArray[np.int16]  # (elevation, azimuth) -1 for none: the snap itself
    emission: npt.NDArray[np.int16]  # (elevation, azimuth) which snap
    family: npt.NDArray[
        np.int8
    ]  # (elevation, azimuth) index into FAMILIES: how it reached the array; no direct: a ghost
    facet: npt.NDArray[np.int32]  # (elevation, azimuth) that brings most; -1 for none
    true_range: npt.NDArray[np.float32]  # (elevation, azimuth) m from the array centre to where the echo was made
    distance: npt.NDArray[np.float32]  # (elevation, azimuth) m from the point to the nearest surface of the target
    origin: npt.NDArray[np.int8]  # (elevation, azimuth) index into ORIGINS


@dataclass(frozen=True, eq=False)
class Truth:
    """Exact ground truth of a frame, from the same arrivals that made the signals.

    Poses, boxes and beams are those of the frame's instant. What is heard is of when the sound met the target: where it
    was then is `position_at_echo`, which echoes, images and points are to be judged by.
    """

    sonar_position: Floats  # (xyz) m, world
    sonar_orientation: Floats  # (wxyz)
    target_position: Floats  # (target, xyz) m, world
    target_orientation: Floats  # (target, wxyz)
    target_velocity: Floats  # (target, xyz) m/s, world
    meeting_time: Floats  # (snap, target) s: when the sound of each snap, by the direct path, meets the target's origin
    position_at_echo: Floats  # (snap, target, xyz) m, world: the origin then; NaN where no direct path leads to it
    box: Floats  # (target, corner 8, xyz) m: oriented bounding box, sonar frame
    image_box: Floats  # (target, 4): azimuth min, max, elevation min, max (rad) of what is seen and in view; or NaN
    view: npt.NDArray[np.int8]  # (target,) how much of it is in the view of the beams: `labelling.views.View`
    visible_fraction: Floats  # (target,) share of the area facing the array that the array sees, in view or not
    snap_position: Floats  # (snap, xyz) m, world
    snap_time: Floats  # (snap,) s
    snap_level: Floats  # (snap,) dB re 1 uPa at 1 m
    beam_target: npt.NDArray[np.int16]  # (elevation, azimuth) -1 for none
    beam_facet: npt.NDArray[np.int32]  # (elevation, azimuth) -1 for none
    beam_range: npt.NDArray[np.float32]  # (elevation, azimuth) m to the first surface in the beam's direction


@dataclass(frozen=True, eq=False)
class Echoes:
    """Where the echoes of each target come from, by the boundaries that they touched on their way to the array.

    What comes by surface or bed is a ghost: the array sees the target mirrored there. Levels are of the energy in the
    band: phases count among the coherent paths of a snap and family (`LEDGER`), powers of all else are summed.
    Directions are weighted by the share of each path in that. NaN where no path comes that way, directions also where
    echoes come from several sides, as by surface and bed both from above and from below.
    """

    azimuth: Floats  # (target, family) rad, sonar frame
    elevation: Floats  # (target, family) rad
    level: Floats  # (target, family) dB re 1 uPa: peak of a snap, times what the echoes bring of its energy in the band


LEDGER = (
    "source_level",
    "transmission_loss_out",
    "scattering",
    "transmission_loss_in",
    "absorption_loss",
    "boundary_loss",
    "received_level",
)
"""Ledger terms in dB: received = source - loss_out + scattering - loss_in - absorption - boundary.

Source is the peak level of the snap at 1 m before any filter. Received is that, and the ratio of the energy in the band
of the sonar that the paths of the family bring to the array centre over the energy that the snap has there at 1 m:
10 log10(sum_f |H S|^2 / sum_f |S|^2), S the spectrum of the snap through the anti-alias filter, H the transfer function
of the paths: coherent ones are summed with their phases, the powers of the others are added. Losses are ratios of sums
of the powers of the paths with and without one factor: means of the losses of the paths, weighted by power. Scattering
is what is left: the target strength, with what phases add or cancel; 0 dB of paths from snap to array.
"""


@dataclass(frozen=True, eq=False)
class Ledger:
    """Levels of each (snap, target, family) in dB that add up, and those of one path of it alone.

    The isolated path is the loudest of its family. Its level is predicted from the columns of `Arrivals`, over the band
    like the others; what is measured in the signals of that path alone must agree (`verification`).
    """

    level: Floats  # (snap, target + 1, family, LEDGER) dB; the last target row is the direct path; NaN without paths
    paths: Ints  # (snap, target + 1, family)
    error_bound: Floats  # (snap, target + 1, family) dB
    isolated_level: Floats  # (snap, target + 1, family) dB re 1 uPa at the array centre; NaN without a path
    isolated: Arrivals  # the isolated paths, in the order of the levels that are not NaN
