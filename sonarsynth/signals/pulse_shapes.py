"""How the pulses of paths differ in shape: turned in phase, blurred, stretched, and as facets change them.

A pulse of spectrum S, after a phase, a blur of variance v and a Doppler s, has the spectrum
    exp(i phase) exp(-v g(f)) (1 + s) S((1 + s) f),  g = (2 pi f)^2/2,  f > 0,
times what its facet does (`equations.scattering.facet_pulses`), a point on a smooth surface of few dimensions. What all
paths share is taken to the spectrum. What differs is expanded in modes, sum_k weight[path, k] spectrum[k, bin], and
with it the absorption, which may then have no terms of its own: first in the cosine and sine of phase, in Chebyshev
polynomials of Doppler and of what is absorbed, in mean powers of the delays over a facet, and in values of exp(-v g)
and of what a rough facet sends at some frequencies; then, by singular values, in the fewest that these paths need
(Eckart and Young, 1936).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from sonarsynth.conventions import Complexes, Floats
from sonarsynth.equations.scattering.facet_pulses import mean_powers, rough_factor
from sonarsynth.signals.array_paths import ArrayPaths
from sonarsynth.signals.gridded.nodes import Axis, analysis, chebyshev, interpolation, polynomials, rounded_up

FEW = 4
"""So many functions are not worth a reduction before they are multiplied by others."""

SAMPLES = (1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 14, 16, 20, 24, 32, 48, 64, 96, 128)
"""How many frequencies a blur may be sampled at."""

MOST_PHASE = 12.0
"""rad: facets with corners further than this from their middle, at the highest frequency, have no series in them."""

MOST_POWERS = 80
"""Powers of the phase over a facet that may be needed, and some more."""


class Modes(NamedTuple):
    """Pulses of paths, as a sum: weight @ spectrum. The spectra are orthogonal and of one norm."""

    weight: Floats  # (path, mode)
    spectrum: Complexes  # (mode, bin)


class Reduction(NamedTuple):
    """From weights and spectra to fewer: weight @ onto, back @ spectrum."""

    onto: Floats  # (given, mode)
    back: Floats  # (mode, given)


def blur_exponent(frequency: Floats) -> Floats:
    """Exponent g(f) (1/s2) of a blur: (2 pi f)^2/2."""
    return np.asarray(0.5 * (2.0 * np.pi * frequency) ** 2)


def reduction(weight: Floats, spectrum: Complexes, loudness: Floats, tolerance: float) -> Reduction:
    """The fewest modes of weight (path, given) @ spectrum (given, bin) times loudness (path,), to `tolerance` of the
    loudest path and of their root mean square."""
    sampled = spectrum[:, :: max(1, spectrum.shape[1] // 128)]
    rows = np.asarray(np.linalg.qr(np.concatenate([sampled.real, sampled.imag], axis=1).T, mode="r")).T
    loud = np.multiply(weight.T, loudness, order="C")
    weighted = np.linalg.qr(loud.T, mode="r")
    left, size, v = np.linalg.svd(weighted @ rows, full_matrices=False)
    onto = rows @ v.T
    keep = _sizes(np.abs(onto.T @ loud)) > tolerance
    onto, size = onto[:, keep], size[keep]
    back = left[:, keep].T @ weighted / size[:, None]
    scale = size[0] / np.linalg.norm(loudness)  # makes the weights of the first about 1
    return Reduction(onto / scale, back * scale)


def _sizes(weighted: Floats) -> Floats:
    """Sizes (mode,) over the first, of moduli (mode, path): of root mean squares, and of the largest."""
    mean, largest = np.sqrt(np.einsum("mp,mp->m", weighted, weighted)), weighted.max(axis=1)
    return np.asarray(np.maximum(mean / mean[0], largest / largest[0]))


def main_modes(weight: Floats, loudness: Floats) -> tuple[Floats, tuple[float, ...]]:
    """Turn (mode, mode) of orthogonal modes with weights (path, mode) that puts the largest first, and their sizes over
    that of the first, rounded up by at most a fifth, so that choices are kept from frame to frame."""
    weighted = np.multiply(weight.T, loudness, order="C")
    turn = np.linalg.eigh(weighted @ weighted.T)[1][:, ::-1]  # a turn whatever rounds: sizes are those of what it gives
    sizes = _sizes(np.abs(turn.T @ weighted))
    return turn, (1.0, *(min(rounded_up(s, 1.2), 1.0) for s in sizes[1:].tolist()))


def shape_modes(
    front: ArrayPaths,
    frequency: Floats,
    spectrum: Complexes,
    decay: Floats,
    series: Complexes,
    widest: float,
    tolerance: float,
) -> Modes:
    """The modes of pulses: of phase, of blur, of absorption, of facets, and of Doppler where there is a series (degree,
    bin) in Doppler/widest.

    spectrum (bin,) is of the pulse without them; decay (bin,) is in Np for each dB of the paths' loss.
    """
    loudness = np.abs(front.amplitude) / np.abs(front.amplitude).max()
    weight: Floats = np.ones((front.count, 1))
    factor: Floats | Complexes = np.ones((1, frequency.size))

    def fewest(weight: Floats, factor: Any) -> tuple[Floats, Any]:
        if len(factor) <= FEW:
            return weight, factor
        fewer = reduction(weight, factor * spectrum, loudness, tolerance)
        return weight @ fewer.onto, fewer.back @ factor

    if front.variance.any() or front.coherent_fraction.any():
        weight, factor = fewest(*_softened(front, frequency, tolerance))
    if front.loss.any() and decay.any():
        weight, factor = fewest(*_times(weight, factor, *_absorbed(front.loss, decay, tolerance)))
    if front.corner_delays.any():
        powers = _powers(front.corner_delays, frequency, spectrum, tolerance)
        weight, factor = _times(weight, factor, *fewest(*powers))
    spectra = factor * spectrum
    if len(series):
        weight, spectra = _times(weight, factor, polynomials(front.doppler / widest, len(series)), series)
    if front.phase.any():
        turn = front.phase[:, None]
        weight = np.concatenate([weight * np.cos(turn), weight * np.sin(turn)], axis=1)
        spectra = np.concatenate([spectra, 1j * spectra])
    fewer = reduction(weight, spectra, loudness, tolerance)
    return Modes(weight @ fewer.onto, fewer.back @ spectra)


def _times(weight: Floats, factor: Any, more: Floats, waves: Any) -> tuple[Floats, Any]:
    """The product of weight (path, given) @ factor (given, bin) and more (path, other) @ waves (other, bin)."""
    both = np.multiply(weight.T[:, None], more.T, order="C")  # paths in the inner loop
    return both.reshape(-1, len(weight)).T, (factor[:, None] * waves).reshape(len(both) * both.shape[1], -1)


def _absorbed(loss: Floats, decay: Floats, tolerance: float) -> tuple[Floats, Floats]:
    """exp(-loss decay) of paths with a loss (path,): Chebyshev polynomials in it (path, degree), and of frequency
    (degree, bin). The coefficient of degree n is 2 I_n(x), about 2 (x/2)^n/n!, x the most that is lost (Np)."""
    most = float(np.abs(loss).max())
    half = 0.5 * most * float(np.abs(decay).max())
    count, size = 1, 2.0 * half
    while size > tolerance:
        count += 1
        size *= half / count
    lost = np.exp(-np.multiply.outer(most * chebyshev(count), decay))
    return polynomials(loss / most, count), analysis(count) @ lost


def _powers(corners: Floats, frequency: Floats, spectrum: Complexes, tolerance: float) -> tuple[Floats, Complexes]:
    """The mean of a wave over facets with corners (path, 3): powers of the delay (path, given), and of the frequency
    (given, bin)."""
    scale = float(np.abs(corners).max())
    phase, mass = -2j * np.pi * scale * frequency, np.abs(spectrum) / np.abs(spectrum).sum()
    ratio = phase / np.arange(1, MOST_POWERS)[:, None]
    waves = np.cumprod(np.concatenate([np.ones((1, frequency.size)), ratio]), axis=0)  # (-i w scale)^j/j!
    remainder = np.cumsum((np.abs(waves) @ mass)[::-1])[::-1]
    count = max(3, int(np.argmax(np.append(remainder, 0.0) <= tolerance)))
    powers = np.append(0, np.arange(2, count))  # the mean of the first power is 0
    return mean_powers(corners, scale, count).T[:, powers], waves[powers]


def _softened(front: ArrayPaths, frequency: Floats, tolerance: float) -> tuple[Floats, Floats]:
    """What blur and rough facets leave at some frequencies (path, given), and their interpolation in the logarithm of
    frequency (given, bin). Degrees of a product add up."""
    low, high = float(frequency[0]), float(frequency[-1])
    low = low if low > 0.0 else 0.1 * float(frequency[min(1, frequency.size - 1)]) or 1.0  # 0 Hz has no logarithm
    high = max(high, low)
    span = max(float(np.log(high / low)), 1e-3)
    position = 2.0 * np.log(np.maximum(frequency, low) / high) / span + 1.0
    steepest = float(front.variance.max() * blur_exponent(frequency)[-1])
    count, wide = 1, float(np.ceil(10.0 * span)) / 10.0
    if front.coherent_fraction.any():
        roughest = 2.0 * np.pi * high * float(front.height_delay_std.max())
        count += _rough_samples(rounded_up(roughest, 1.25), wide, tolerance) - 1
    if steepest > 0.0:
        count += _samples(rounded_up(steepest, 1.25), wide, tolerance) - 1
    at = high * np.exp(0.5 * span * (chebyshev(count) - 1.0))
    factor = np.exp(-np.multiply.outer(front.variance, blur_exponent(at)))
    if front.coherent_fraction.any():
        factor *= rough_factor(at, front.coherent_fraction, front.height_delay_std)
    return factor, np.asarray(interpolation(position, Axis(count)).T)


@lru_cache(maxsize=256)
def _samples(steepest: float, span: float, tolerance: float) -> int:
    """How many frequencies, Chebyshev in the logarithm, `span` between the ends, give every blur up to the exponent
    `steepest` at the highest."""
    x = np.linspace(-1.0, 1.0, 257)
    exponents = np.append(0.0, np.geomspace(min(1e-3, 0.1 / steepest), 1.0, 64)) * steepest

    def blurs(at: Floats) -> Floats:
        return np.asarray(np.exp(-np.multiply.outer(np.exp(span * (at - 1.0)), exponents)))

    for count in SAMPLES:
        if np.abs(interpolation(x, Axis(count)) @ blurs(chebyshev(count)) - blurs(x)).max() <= tolerance:
            return count
    return SAMPLES[-1]


@lru_cache(maxsize=256)
def _rough_samples(roughest: float, span: float, tolerance: float) -> int:
    """How many frequencies, Chebyshev in the logarithm, `span` between the ends, give what rough facets of any share
    send, with g up to `roughest` at the highest."""
    x = np.linspace(-1.0, 1.0, 257)
    shares = 1.0 - np.append(0.0, np.geomspace(1e-6, 0.9, 16))
    delays = np.geomspace(min(1e-3, 0.1 * roughest), roughest, 48) / (2.0 * np.pi) if roughest > 0.0 else np.zeros(1)
    share, delay = (g.ravel() for g in np.meshgrid(shares, delays))

    def left(at: Floats) -> Floats:
        return rough_factor(np.exp(span * (at - 1.0)), share, delay).T

    exact = left(x)
    size = np.maximum(exact.max(axis=0), 1e-300)
    for count in SAMPLES:
        if (np.abs(interpolation(x, Axis(count)) @ left(chebyshev(count)) - exact) / size).max() <= tolerance:
            return count
    return SAMPLES[-1]
