"""Cosines and sines of phases, a group of lanes at once, and beams from them: compiled kernels.

Phases are in turns, reduced in float64 before anything is rounded to float32. "Half" phasors are right up to a sign,
that of the cosine and the sine alike: enough where energies are wanted, and the series need span half a turn only.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats
from sonarsynth.equations.kernels.lanes import (
    LANES,
    WIDE,
    load,
    load_complex,
    nearest,
    ramp,
    splat,
    store,
    store_complex,
)

# Series for +-1/4 turn, least squares weighted towards minimax; each coefficient was rounded to float32 before the next
# were fitted, so that roundings make up for one another: 4e-9 of truncation, and no bias of the amplitude.
C0, C1, C2, C3, C4, C5 = (
    np.float32(c)
    for c in (1.0, -19.739208221435547, 64.93928527832031, -85.4503402709961, 60.07903289794922, -24.538782119750977)
)
S0, S1, S2, S3, S4, S5 = (
    np.float32(s)
    for s in (
        6.2831854820251465,
        -41.341758728027344,
        81.61032104492188,
        -76.89103698730469,
        45.002044677734375,
        -31.819440841674805,
    )
)
Spectra = npt.NDArray[np.complex64]

SINE = tuple((-1.0) ** n * math.pi ** (2 * n + 1) / math.factorial(2 * n + 1) for n in range(9))
"""Series of sin(pi t) by odd powers of t, to 3e-14 for |t| up to 1/2."""
TINY = 1e-150
"""Half turns, of which the sine is pi times as much."""

ZERO, HALF, TWO = np.float32(0.0), np.float32(0.5), np.float32(2.0)

GROUPS = 4 if WIDE else 2
"""Groups of lanes in a chunk: a phase is reduced once a chunk, then turned on from group to group (6e-8 each time). Of
narrow lanes four would be no faster, and the beams of 64 hydrophones in a row err by a third more."""

CHUNK = GROUPS * LANES

STEERED = 4 * LANES
"""Frequencies that `_steered_sums` sums at once."""


@compiled(fastmath={"contract"}, forceinline=True)
def sine(t: float) -> float:
    """sin(pi t), t in half turns, by its Taylor series, without a branch or a call: of many numbers, eight at once."""
    whole = np.rint(t)
    rest = t - whole
    x, odd = rest * rest, abs(whole - 2.0 * np.rint(0.5 * whole))
    series = SINE[4] + x * (SINE[5] + x * (SINE[6] + x * (SINE[7] + x * SINE[8])))
    series = SINE[0] + x * (SINE[1] + x * (SINE[2] + x * (SINE[3] + x * series)))
    return float((1.0 - 2.0 * odd) * rest * series)


@compiled(fastmath={"contract"}, forceinline=True)
def face_response(y: float, z: float) -> float:
    """Of a square face, sinc y sinc z: `apertures.element_directivity`; y, z: how many wavelengths wide it is along y
    and along z, as the wave comes."""
    y, z = y if abs(y) > TINY else TINY, z if abs(z) > TINY else TINY
    return sine(y) * sine(z) / (math.pi**2 * y * z)


@compiled(fastmath={"contract"})
def fill_face_responses(y: Any, z: Any, response: Any) -> None:
    """Fill responses (wave,) of a face that is y (wave,) and z (wave,) wavelengths wide: `face_response`."""
    for i in range(len(y)):
        response[i] = face_response(y[i], z[i])


@compiled(forceinline=True)
def half_phasor(turns: Any, more: Any) -> Any:
    """Cosine and sine (lanes) of `turns` + `more` (lanes, |more| small) up to one sign; error 1e-7."""
    t = turns + more
    low = ((turns - t) + more) * splat(S0)
    t = t - splat(HALF) * nearest(splat(TWO) * t)
    x = t * t
    c = splat(C0) + x * (splat(C1) + x * (splat(C2) + x * (splat(C3) + x * (splat(C4) + x * splat(C5)))))
    s = t * (splat(S0) + x * (splat(S1) + x * (splat(S2) + x * (splat(S3) + x * (splat(S4) + x * splat(S5))))))
    return c - low * s, s + low * c


@compiled(forceinline=True)
def half_phasors(delay: float, frequency: float, spacing: float) -> Any:
    """Cosine and sine (lanes) of 2 pi delay (frequency + spacing * 0, 1, ...), up to one sign a lane. s, Hz, Hz."""
    turns = delay * frequency
    turns -= 0.5 * np.rint(2.0 * turns)
    high = np.float32(turns)
    return half_phasor(splat(high), splat(np.float32(turns - high)) + splat(np.float32(delay * spacing)) * ramp())


@compiled(forceinline=True)
def turned(c: Any, s: Any, by_c: Any, by_s: Any) -> Any:
    """Phasor (c, s) turned on by another."""
    return c * by_c - s * by_s, s * by_c + c * by_s


@compiled(forceinline=True)
def phasors(delay: float, frequency: float, spacing: float) -> Any:
    """Cosine and sine (lanes) of 2 pi delay (frequency + spacing * 0, 1, ...): the half angle, doubled; error 3e-7."""
    c, s = half_phasors(0.5 * delay, frequency, spacing)
    return turned(c, s, c, s)


@compiled(forceinline=True)
def weighted(pairs: Any, at: int, weight: float) -> Any:
    """Real and imaginary parts (lanes) of weight times complex numbers, pairs of float32 from pairs[at] on."""
    x, y = load_complex(pairs, at)
    return splat(weight) * x, splat(weight) * y


@compiled(forceinline=True)
def group_steps(delays: Any, spacing: float, cosines: Any, sines: Any) -> None:
    """Fill cosines, sines (float32) with half phasors of 2 pi delay LANES spacing: one group of frequencies on.

    All three arrays are of one length, a multiple of LANES.
    """
    for i in range(len(delays)):
        turns = delays[i] * (LANES * spacing)
        turns -= 0.5 * np.rint(2.0 * turns)
        cosines[i] = np.float32(turns)
        sines[i] = np.float32(turns - cosines[i])
    for i in range(0, len(delays), LANES):
        c, s = half_phasor(load(cosines, i), load(sines, i))
        store(cosines, i, c)
        store(sines, i, s)


@compiled(forceinline=True)
def _accumulate(pairs: Any, at: int, c: Any, s: Any, real: Any, imaginary: Any) -> Any:
    x, y = load_complex(pairs, at)
    return real + c * x - s * y, imaginary + c * y + s * x


@compiled
def _steered_sums(pairs: Any, delay: Any, weight: Any, frequency: float, spacing: float, bins: int, beams: Any) -> None:
    sensors = len(weight)
    padded = sensors + -sensors % LANES
    half_delay = np.zeros(padded)
    step_c, step_s = np.empty(padded, np.float32), np.empty(padded, np.float32)
    zero = splat(ZERO)
    for beam in range(len(delay)):
        half_delay[:sensors] = 0.5 * delay[beam]
        group_steps(half_delay, spacing, step_c, step_s)
        for low in range(0, bins, STEERED):
            r0 = i0 = r1 = i1 = r2 = i2 = r3 = i3 = zero
            for q in range(sensors):
                c, s = phasors(delay[beam, q], frequency + low * spacing, spacing)
                c, s = splat(weight[q]) * c, splat(weight[q]) * s
                by_c, by_s = splat(step_c[q]), splat(step_s[q])
                by_c, by_s = turned(by_c, by_s, by_c, by_s)
                at = 2 * (q * bins + low)
                r0, i0 = _accumulate(pairs, at, c, s, r0, i0)
                c, s = turned(c, s, by_c, by_s)
                r1, i1 = _accumulate(pairs, at + 2 * LANES, c, s, r1, i1)
                c, s = turned(c, s, by_c, by_s)
                r2, i2 = _accumulate(pairs, at + 4 * LANES, c, s, r2, i2)
                c, s = turned(c, s, by_c, by_s)
                r3, i3 = _accumulate(pairs, at + 6 * LANES, c, s, r3, i3)
            at = 2 * (beam * bins + low)
            store_complex(beams, at, r0, i0)
            store_complex(beams, at + 2 * LANES, r1, i1)
            store_complex(beams, at + 4 * LANES, r2, i2)
            store_complex(beams, at + 6 * LANES, r3, i3)


def padded_bins(spectra: Spectra, rows: int, multiple: int) -> Spectra:
    """Spectra (sensor, bin) complex64 with zeros after them: `rows` sensors, bins a multiple of `multiple`."""
    sensors, bins = spectra.shape
    padded = np.empty((rows, bins + -bins % multiple), np.complex64)
    padded[:sensors, :bins], padded[:sensors, bins:], padded[sensors:] = spectra, 0.0, 0.0
    return padded


def steered_sums(spectra: Spectra, delay: Floats, weight: Floats, frequency: float, spacing: float) -> Spectra:
    """Sum over sensors of weight * spectra * exp(+i 2 pi f delay): (beam, bin) complex64.

    spectra (sensor, bin) at f = frequency + spacing * bin (Hz), delay (beam, sensor) s, weight (sensor,).
    """
    live = np.flatnonzero(weight)
    bins = spectra.shape[1]
    padded_spectra = padded_bins(spectra[live], len(live), STEERED)
    beams = np.empty((len(delay), padded_spectra.shape[1]), np.complex64)
    _steered_sums(
        padded_spectra.view(np.float32).ravel(),
        np.ascontiguousarray(delay[:, live]),
        weight[live].astype(np.float32),
        frequency,
        spacing,
        padded_spectra.shape[1],
        beams.view(np.float32).ravel(),
    )
    return beams[:, :bins]
