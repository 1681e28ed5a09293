"""Arrays of hydrophones: element directivity, focusing delays, spectra of a gate, beams, their energy.

The beam of direction u (unit vector to the source) is

    B(f) = sum_q g_q P_q(f) exp(+i 2 pi f tau_q) / sum_q g_q,

with tau_q the time by which sensor q hears a source at u later than the array centre does: a plane wave of pressure p
from u gives back p.
Source: any text on arrays, e.g. Van Trees (2002), Optimum Array Processing, sections 2.2 and 6.2.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats, Ints

GATE_TAPER: Final = 1e-4
"""Length (s) of the raised cosine at each end of a gate; a quarter of the gate at most."""

SENSORS_AT_ONCE: Final = 64
"""Sensors whose gates are transformed together: they stay in the cache."""


def aperture_terms(position: npt.ArrayLike, aperture: float) -> Floats:
    """Polynomials up to the third degree over the aperture (..., term) at positions (..., xyz) in the sonar frame.

    Coordinates are divided by `aperture` (m). The basis is the 20 monomials of x, y, z: 1; x, y, z; xx, xy, xz, yy, yz,
    zz; xxx, xxy, xxz, xyy, xyz, xzz, yyy, yyz, yzz, zzz. On a planar array those with x vanish.
    """
    x, y, z = np.moveaxis(np.asarray(position, float) / aperture, -1, 0)
    one = np.ones_like(x)
    second = [x * x, x * y, x * z, y * y, y * z, z * z]
    third = [
        x * x * x,
        x * x * y,
        x * x * z,
        x * y * y,
        x * y * z,
        x * z * z,
        y * y * y,
        y * y * z,
        y * z * z,
        z * z * z,
    ]
    return np.stack([one, x, y, z, *second, *third], axis=-1)


def element_directivity(frequency: npt.ArrayLike, direction: npt.ArrayLike, face: float, sound_speed: float) -> Floats:
    """Far-field response of a square face in the plane x = 0 to a plane wave from `direction` (..., xyz), sonar frame.

    The mean of the pressure over the face (side `face`, m): sinc(f w u_y / c) sinc(f w u_z / c) with
    sinc x = sin(pi x)/(pi x); 1 for a point. frequency (...) in Hz broadcasts against direction without its last axis.
    Source: any text on arrays, e.g. Van Trees (2002), Optimum Array Processing, section 2.6.
    """
    u = np.asarray(direction, float)
    scale = np.asarray(frequency, float) * (face / sound_speed)
    return np.asarray(np.sinc(scale * u[..., 1]) * np.sinc(scale * u[..., 2]))


def focus_delay(position: npt.ArrayLike, direction: npt.ArrayLike, focus: float | None, sound_speed: float) -> Floats:
    """Delay (..., sensor) in s after the array centre at which sensors hear a source at `focus` (m) in `direction`.

    position (sensor, xyz) m, direction (..., xyz) unit vectors to the source, focus None for a plane wave:
    tau = (sqrt(R^2 - 2 R u.q + q^2) - R)/c, written with 1/R so that neither a far focus nor a small array cancels.
    """
    q = np.asarray(position, float)
    along = np.asarray(direction, float) @ q.T
    curvature = 0.0 if focus is None else 1.0 / focus
    bulge = curvature * np.sum(q * q, axis=-1) - 2.0 * along
    return np.asarray(bulge / ((1.0 + np.sqrt(np.maximum(1.0 + curvature * bulge, 0.0))) * sound_speed))


def gate_samples(
    start: float, stop: float, first_time: float, sampling_frequency: float, samples: int
) -> tuple[int, int]:
    """First sample and number of samples of the gate [start, stop] (s); sample 0 of the signals is at `first_time` (s).

    The number depends on the length of the gate alone, so that every frame has the same frequencies. Raises ValueError
    when the gate holds no sample or reaches outside the signals: what was not recorded is not silence.
    """
    length = (stop - start) * sampling_frequency
    if not (np.isfinite(start) and np.isfinite(length) and length >= 1.0 - 1e-6):
        raise ValueError(f"window {start:g} to {stop:g} s holds no sample at {sampling_frequency:g} Hz")
    first, count = int(np.ceil((start - first_time) * sampling_frequency - 1e-6)), int(np.floor(length + 1e-6))
    if first < 0 or first + count > samples:
        end = first_time + samples / sampling_frequency
        raise ValueError(f"window {start:g} to {stop:g} s reaches outside the signals, {first_time:g} to {end:g} s")
    return first, count


def gate_taper(count: int, sampling_frequency: float) -> npt.NDArray[np.float32]:
    """Weights (count,) of a gate: one, with raised cosines of `GATE_TAPER` at both ends."""
    length = min(round(GATE_TAPER * sampling_frequency), count // 4)
    rise = np.sin(0.5 * np.pi * (np.arange(length) + 0.5) / max(length, 1)) ** 2
    return np.concatenate([rise, np.ones(count - 2 * length), rise[::-1]]).astype(np.float32)


def fast_length(count: int) -> int:
    """Length of the FFT of a gate of `count` samples: the next that is fast."""
    from scipy.fft import next_fast_len

    return int(next_fast_len(count, real=True))


def frequency_spacing(count: int, sampling_frequency: float) -> float:
    """Distance (Hz) of the frequencies of a gate of `count` samples: those of its FFT, padded to a fast length."""
    return float(sampling_frequency / fast_length(count))


def gated_spectra(
    pressure: npt.NDArray[np.floating],
    sampling_frequency: float,
    first_sample: int,
    count: int,
    band: tuple[float, float],
) -> tuple[Floats, npt.NDArray[np.complex64]]:
    """Frequencies (bin,) in Hz and rfft spectra (sensor, bin) in Pa of a gate, bins of the band (low, high) only.

    pressure (sensor, sample) Pa. Phases refer to `first_sample`. The gate is tapered (`gate_taper`) and padded with
    zeros to a fast length (`frequency_spacing`). Raises ValueError when no frequency in band is below half the sampling
    frequency.
    """
    from scipy.fft import rfft

    length = fast_length(count)
    low, high = (edge * length / sampling_frequency for edge in band)
    # Nothing is known of the phase at half the sampling frequency, so that bin never counts.
    lowest, highest = int(np.ceil(low - 1e-9)), min(int(np.floor(high + 1e-9)), (length - 1) // 2)
    if highest < lowest:
        raise ValueError(
            f"a window of {count} samples resolves no frequency in {band[0]:g} to {band[1]:g} Hz: take a longer one"
        )
    taper = gate_taper(count, sampling_frequency)
    spectra = np.empty((len(pressure), highest + 1 - lowest), np.complex64)
    for low in range(0, len(pressure), SENSORS_AT_ONCE):
        some = slice(low, low + SENSORS_AT_ONCE)
        cut = pressure[some, first_sample : first_sample + count] * taper
        spectra[some] = rfft(cut, length, axis=1)[:, lowest : highest + 1]
    return np.arange(lowest, highest + 1, dtype=float) * (sampling_frequency / length), spectra


def live_gain(gain: npt.ArrayLike) -> Floats:
    """Element gains (sensor,) divided by their sum. Raises ValueError when it is not above zero: no element hears."""
    g = np.asarray(gain, float)
    if not g.sum() > 0.0:
        raise ValueError("the array has no live element")
    return np.asarray(g / g.sum())


def hann_shading(position: npt.ArrayLike, rim: float) -> Floats:
    """Weights (sensor,) at positions (sensor, xyz) that fall as cos^2 from the centre to zero `rim` (m) away."""
    distance = np.linalg.norm(np.asarray(position, float), axis=-1)
    return np.asarray(np.cos(0.5 * np.pi * distance / np.maximum(rim, np.finfo(float).tiny)) ** 2)


def beam_spectra(
    spectra: npt.NDArray[np.complex64],
    frequencies: Floats,
    position: npt.ArrayLike,
    gain: npt.ArrayLike,
    directions: npt.ArrayLike,
    sound_speed: float,
    focus: float | None,
) -> npt.NDArray[np.complex64]:
    """Spectra (beam, bin) of beams steered in `directions` (beam, xyz) and focused at `focus` (m; None: plane waves).

    spectra (sensor, bin) at evenly spaced frequencies (bin,) Hz; position (sensor, xyz) m; gain (sensor,), 0 for a dead
    element. Any array, exact spherical delays, float32 sums: error 2e-6 of the largest |B|. Raises ValueError when no
    element is live.
    """
    from sonarsynth.acoustics.phasors import steered_sums

    weight = live_gain(gain)
    u = np.asarray(directions, float)
    delay = focus_delay(position, u, focus, sound_speed)
    spacing = float(frequencies[1] - frequencies[0]) if len(frequencies) > 1 else 1.0
    return steered_sums(spectra, delay, weight, float(frequencies[0]), spacing)


def lattice_beam_spectra(
    spectra: npt.NDArray[np.complex64],
    frequencies: Floats,
    column: Ints,
    row: Ints,
    shape: tuple[int, int],
    pitch: float,
    gain: npt.ArrayLike,
    directions: npt.ArrayLike,
    sound_speed: float,
    focus: float | None,
) -> npt.NDArray[np.complex64]:
    """As `beam_spectra` for elements of a lattice, focused in every direction as on the axis; several times as fast.

    column, row (sensor,): 0 at port (+y) and at the top (+z), of `shape` (columns, rows) `pitch` (m) apart, centred on
    the origin in the plane x = 0. The delay of focusing is (sqrt(R^2 + q^2) - R)/c, so that rows and columns separate:
    off the axis that is not quite a sphere (`beamforming.FocusedDelayAndSum` has a table). Beams of one elevation share
    the sums over rows. Float32 sums: error 1e-6 of the largest |B| (508 elements), 3e-6 for 64 in a row, 1.3e-5 for
    300. Raises ValueError when no element is live.
    """
    from sonarsynth.acoustics.lattice_beams import corners, lattice_sums

    weight = live_gain(gain)
    places = corners(column, row, *shape, np.flatnonzero(weight), len(weight))
    y, z = (pitch * np.arange((n + 1) % 2, n, 2) / 2 for n in shape)
    sensors = np.stack(np.broadcast_arrays(0.0, y[:, None], z), axis=-1)
    delay = focus_delay(sensors.reshape(-1, 3), np.array([1.0, 0.0, 0.0]), focus, sound_speed).reshape(len(y), len(z))
    step = np.asarray(directions, float) * (-pitch / sound_speed)
    spacing = float(frequencies[1] - frequencies[0]) if len(frequencies) > 1 else 1.0
    odd = shape[1] % 2 == 1, shape[0] % 2 == 1
    first = float(frequencies[0])
    return lattice_sums(spectra, places, weight, delay, step[:, 2], step[:, 1], odd, first, spacing)


def beam_energy(beams: npt.NDArray[np.complexfloating], spacing: float, sampling_frequency: float) -> Floats:
    """Energy (...) in Pa2 s of beams (..., bin) whose bins are `spacing` (Hz) apart, by Parseval.

    (2 df/fs^2) sum |B|^2, which is int p^2 dt for a wave p(t) whose spectrum lies inside the bins.
    """
    return np.asarray(
        spectrum_energy(spacing, sampling_frequency) * np.sum(np.abs(beams.astype(np.complex128)) ** 2, axis=-1)
    )


def spectrum_energy(spacing: float, sampling_frequency: float) -> float:
    """Energy (Pa2 s) of a real signal whose rfft is 1 (Pa) in one bin, bins `spacing` (Hz) apart: 2 df/fs^2."""
    return 2.0 * spacing / sampling_frequency**2
