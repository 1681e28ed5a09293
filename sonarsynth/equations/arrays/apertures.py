"""Arrays of hydrophones: element directivity, focusing delays, weights."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats


def element_directivity(frequency: npt.ArrayLike, direction: npt.ArrayLike, face: float, sound_speed: float) -> Floats:
    """Far-field response of a square face in the plane x = 0 to a plane wave from `direction` (..., xyz), sonar frame.

    The mean of the pressure over the face (side `face`, m): sinc(f w u_y / c) sinc(f w u_z / c) with
    sinc x = sin(pi x)/(pi x); 1 for a point. frequency (...) in Hz broadcasts against direction without its last axis.
    Source: any text on arrays, e.g. Van Trees (2002), Optimum Array Processing, section 2.6.
    """
    from sonarsynth.equations.kernels.phasors import fill_face_responses  # compiled: read where it is needed

    u = np.asarray(direction, float)
    scale = np.asarray(frequency, float) * (face / sound_speed)
    y, z = np.broadcast_arrays(scale * u[..., 1], scale * u[..., 2])
    response = np.empty(y.shape)
    fill_face_responses(y.ravel(), z.ravel(), response.reshape(-1))
    return response


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


def defocus_spread(extent: npt.ArrayLike, curvature: npt.ArrayLike, wavenumber: float) -> Floats:
    """Standard angle (...) in rad by which peaks may be beside a wave that an array is out of focus for.

    extent (...) m: root mean square, of the aperture along one axis; curvature (...) 1/m: of the wave less that of the
    focus; wavenumber in rad/m. Each part of the aperture hears it elsewhere, over an angle extent * curvature rms. One
    peak in the middle stays until the phase is about 2 rad rms: beyond that there are several, near the ends.
    """
    a, k = np.asarray(extent, float), np.abs(np.asarray(curvature, float))
    phase = wavenumber * k * a**2
    return np.asarray(a * k * np.sqrt(np.maximum(1.0 - (2.0 / np.maximum(phase, 1e-30)) ** 2, 0.0)))


def half_power_angle(extent: npt.ArrayLike, wavenumber: float) -> Floats:
    """Angle (...) in rad off its axis at which a beam is down 3 dB, infinite of an array of no extent.

    extent (...) m: root mean square s, of the aperture across the beam; wavenumber in 1/m. 0.808/(2 pi s) wavelengths:
    exact for a narrow beam of a uniform disc (2 J1(x)/x is 0.707 at x = 1.616), 0.6 % too wide for that of a line.
    """
    with np.errstate(divide="ignore"):
        return np.asarray(0.808 / (2 * np.pi * wavenumber * np.asarray(extent, float)))


def half_power_width(extent: npt.ArrayLike, wavenumber: float) -> Floats:
    """Width (...) in rad of a beam between its half-power angles: twice `half_power_angle`, 2 pi at most."""
    return np.minimum(2.0 * half_power_angle(extent, wavenumber), 2.0 * np.pi)


def beams_per_width(width: Floats, azimuth: Floats, elevation: Floats) -> Floats:
    """Beams (2,) of a grid in beam widths (2,), along azimuth (azimuth,) and elevation (elevation,), all in one unit;
    one along an axis of a single beam."""
    axes = zip((azimuth, elevation), np.asarray(width).tolist(), strict=True)
    return np.array([across / np.diff(axis).mean() if len(axis) > 1 else 1.0 for axis, across in axes])


def whole_beams_per_width(width: Floats, azimuth: Floats, elevation: Floats) -> tuple[int, int]:
    """`beams_per_width` in whole beams, along elevation and azimuth as the axes of an image: one at least, and no more
    than the longer of these."""
    most = max(len(azimuth), len(elevation))
    across, up = np.clip(np.round(beams_per_width(width, azimuth, elevation)), 1, most).astype(int).tolist()
    return up, across


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
