"""The echo of a pulse from a flat facet, exact: the Kirchhoff integral of `kirchhoff` in the time domain.

With the delays t_j = (ki - ks).x_j/c of its corners, a facet in a plane wave whose pressure at the origin is s(t) sends

    p(t) = -V (N.(ki - ks))/(2 pi c) S[t-t_0, t-t_1, t-t_2],   S = int s,

over the distance, delayed by distance/c: N its vector area, V its real reflection coefficient, S[...] the second
divided difference of the antiderivative S of the pulse. So a facet costs three look-ups. It is the transform of
`kirchhoff_integral.facet_amplitude`: a facet that mirrors differentiates the pulse, an edge repeats it, a corner
integrates it. Source: Kim et al. (2010), Applied Acoustics 71, 321, for the facet's impulse response.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.special import erfc

from sonarsynth.conventions import Floats
from sonarsynth.equations.bubble import snap_pressure
from sonarsynth.equations.scattering.lobes import dot

CLOSE = 0.25  # of the scale of a pulse: times closer than this go by quadrature instead of differences
NODE, WEIGHT = 0.5 * np.stack(np.polynomial.legendre.leggauss(10))
NODE = 0.5 + NODE
TINY = 1e-300
DEGREE = 7  # of the spline through samples


class Waveform(NamedTuple):
    """A pulse by its antiderivative from minus infinity, itself and its derivative; each takes times (...) (s)."""

    impulse: Callable[[Floats], Floats]  # Pa s
    pressure: Callable[[Floats], Floats]  # Pa
    slope: Callable[[Floats], Floats]  # Pa/s
    scale: float  # s: it is smooth over this time, as sin(t/scale) is
    corners: tuple[float, ...] = ()  # s: where its slope jumps


def facet_echo(
    time: npt.ArrayLike,
    corners: npt.ArrayLike,
    incident: npt.ArrayLike,
    scattered: npt.ArrayLike,
    pulse: Waveform,
    *,
    sound_speed: float = 1500.0,
    reflection: npt.ArrayLike = 1.0,
) -> Floats:
    """Echo (..., sample) (Pa m) at times (sample,) (s) of triangles with corners (..., 3, xyz) (m).

    incident, scattered: unit vectors of propagation (..., xyz), in and away; corners counter-clockwise from outside;
    reflection: V (...), real. Times count from when the pulse's time 0 passes the origin: put it near the facets, since
    a time of 0.1 s is known to 1e-17 s only, which is 1e-11 of a microsecond.
    """
    x, t = np.asarray(corners, float), np.asarray(time, float)
    across = np.asarray(incident, float) - np.asarray(scattered, float)
    delay = dot(x, across[..., None, :]) / sound_speed
    vector_area = 0.5 * np.cross(x[..., 1, :] - x[..., 0, :], x[..., 2, :] - x[..., 0, :])
    factor = dot(vector_area, across) * np.asarray(reflection) / (-2.0 * np.pi * sound_speed)
    return np.asarray(factor[..., None] * divided_impulse(t[:, None] - delay[..., None, :], pulse))


def divided_impulse(times: npt.ArrayLike, pulse: Waveform) -> Floats:
    """Second divided difference S[t0, t1, t2] (...) (Pa/s) of the antiderivative of a pulse at `times` (..., 3) (s).

    The mean slope of the pulse over a triangle whose corners it passes at these times is twice this. Times apart by
    more than a quarter of the pulse's scale by differences, (S[t1, t2] - S[t0, t1])/(t2 - t0); others by Gauss
    quadrature of the derivatives from corner to corner of the pulse. Error under 2e-14 of the largest slope.
    """
    corner_times = np.asarray(times, float)
    t = np.sort(corner_times.reshape(-1, 3), axis=1)
    close = t[:, 2] - t[:, 0] < CLOSE * pulse.scale
    out = np.empty(len(t))
    out[close] = _by_slope(t[close], pulse)
    a, b, c = t[~close].T
    out[~close] = (_mean(b, c, pulse) - _mean(a, b, pulse)) / (c - a)
    return out.reshape(corner_times.shape[:-1])


def _mean(start: Floats, end: Floats, pulse: Waveform) -> Floats:
    """Mean (...) of the pulse from time to time: the first divided difference of its antiderivative."""
    gap = end - start
    close = gap < CLOSE * pulse.scale
    far = ~close
    out = np.empty_like(gap)
    out[close] = _integral(pulse.pressure, start[close], gap[close], None, pulse.corners)
    out[far] = (pulse.impulse(end[far]) - pulse.impulse(start[far])) / gap[far]
    return out


def _by_slope(times: Floats, pulse: Waveform) -> Floats:
    """int_0^1 h(u) s'(t0 + u (t2 - t0)) du (...), h rising from 0 to 1 at t1 and falling to 0; exact for no gap too."""
    a, b, c = times.T
    return _integral(pulse.slope, a, c - a, _share(b - a, c - a), pulse.corners)


def _integral(
    function: Callable[[Floats], Floats], start: Floats, gap: Floats, peak: Floats | None, corners: tuple[float, ...]
) -> Floats:
    """int_0^1 h(u) f(start + u gap) du (...), h the hat with its `peak` at that u, or 1 without one.

    Gauss-Legendre quadrature between what is not smooth: the peak, and the `corners` (s) of the function.
    """
    edges = [np.clip(_share(t - start, gap), 0.0, 1.0) for t in corners] + ([] if peak is None else [peak])
    edge = np.sort(np.stack([np.zeros_like(start), *edges, np.ones_like(start)]), axis=0)
    out = np.zeros_like(start)
    for low, width in zip(edge[:-1], np.diff(edge, axis=0), strict=True):
        u = low[:, None] + width[:, None] * NODE
        value = function(start[:, None] + gap[:, None] * u)
        if peak is not None:
            top = peak[:, None]
            value = value * np.where(u < top, u / np.maximum(top, TINY), (1.0 - u) / np.maximum(1.0 - top, TINY))
        out += width * (value @ WEIGHT)
    return out


def _share(numerator: Floats, denominator: Floats) -> Floats:
    """part/whole; of nothing a half, which is as good as any other share."""
    return np.where(denominator > 0.0, numerator / np.where(denominator > 0.0, denominator, 1.0), 0.5)


def snap_waveform(bubble: snap_pressure.Bubble) -> Waveform:
    """The snap at 1 m: closed forms throughout, S = rho R^2 R', no integration. Its slope jumps at the collapse."""
    return Waveform(
        impulse=lambda t: snap_pressure.impulse(t, bubble),
        pressure=lambda t: snap_pressure.pressure(t, bubble),
        slope=lambda t: _snap_slope(t, bubble),
        scale=1.0 / abs(bubble.q),
        corners=(0.0,),
    )


def _snap_slope(time: Floats, bubble: snap_pressure.Bubble) -> Floats:
    """dp/dt (Pa/s) of the snap at 1 m: rho (R^2 R''' + 6 R R' R'' + 2 R'^3); 0 after the collapse."""
    R, R1, R2 = snap_pressure.wall(time, bubble)
    t = np.minimum(time, 0.0)
    a, k, m, q, density = bubble
    z = k * (t - m) / np.sqrt(2.0)
    growth = [erfc(-z), np.sqrt(2.0 / np.pi) * k * np.exp(-z * z)]  # and its derivatives
    growth.append(-k * k * (t - m) * growth[1])
    growth.append(-k * k * (growth[1] + (t - m) * growth[2]))
    rate = q / (1.0 + q * t)
    collapse = [np.log1p(q * t), rate, -(rate**2), 2.0 * rate**3]
    R3 = a * sum(n * growth[3 - i] * collapse[i] for i, n in enumerate((1.0, 3.0, 3.0, 1.0)))
    return np.where(time <= 0.0, density * (R * R * R3 + 6.0 * R * R1 * R2 + 2.0 * R1**3), 0.0)


def sampled_waveform(start: float, interval: float, pressure: npt.ArrayLike) -> Waveform:
    """A pulse from samples (sample,) (Pa) from `start` (s) on; nothing before and after them.

    A spline of degree 7, whose error is that of the pulse's slope: of a tone with n samples a period, 6e-4 of its peak
    for n = 4, 1.5e-6 for 8 and 1e-8 for 16 (3/n^7). A pulse that is not 0 at its ends has corners there. Raises
    ValueError for under 8 samples or a number that is none.
    """
    from scipy.interpolate import make_interp_spline

    samples = np.asarray(pressure, float)
    if samples.ndim != 1 or samples.size <= DEGREE or not np.isfinite(samples).all():
        raise ValueError(f"a sampled pulse needs more than {DEGREE} samples in one row, all of them numbers")
    if not (np.isfinite(start) and np.isfinite(interval) and interval > 0):
        raise ValueError("a sampled pulse needs a start and an interval above 0 (s)")
    last = start + interval * (samples.size - 1)
    spline = make_interp_spline(start + interval * np.arange(samples.size), samples, k=DEGREE)
    total, slope = spline.antiderivative(), spline.derivative()

    def within(function: Callable[[Floats], Floats], t: Floats) -> Floats:
        return np.where((t >= start) & (t <= last), function(np.clip(t, start, last)), 0.0)

    return Waveform(
        impulse=lambda t: np.asarray(total(np.clip(t, start, last))),
        pressure=lambda t: within(spline, t),
        slope=lambda t: within(slope, t),
        scale=2.0 * interval,
        corners=(float(start), float(last)),
    )
