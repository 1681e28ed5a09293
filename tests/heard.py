"""What an array hears, in closed form: spherical waves of one pulse from points, in water of one sound speed."""

from __future__ import annotations

import numpy as np

from sonarsynth.equations.arrays.spherical_wave import envelope_peak
from sonarsynth.imaging import FocusedDelayAndSum
from sonarsynth.imaging.image_window import snapshots_of
from sonarsynth.products import Signals
from sonarsynth.ranging import IsovelocityPlacing, Peaks
from sonarsynth.ranging.clouds import point_cloud
from sonarsynth.ranging.received_window import ReceivedWindow
from sonarsynth.receiver import Elements

RATE = 196e3
PEAKS, STRAIGHT = Peaks(), IsovelocityPlacing()


def pulse_spectrum(f):
    """A pulse that falls as a snap does, -10 dB from 25 to 85 kHz, cut to that band with 5 kHz flanks."""
    low, high = (np.clip((f - edge) / 5e3, -0.5, 0.5) for edge in (25e3, 85e3))
    return 1e-3 / (1 + 1j * f / 24e3) ** 2 * (0.5 + 0.5 * np.sin(np.pi * low)) * (0.5 - 0.5 * np.sin(np.pi * high))


def envelope_late() -> float:
    """Time (s) after which the envelope of the pulse peaks in the band of the default sonar."""
    f = np.linspace(22e3, 88e3, 1321)
    return envelope_peak(f, pulse_spectrum(f), 25e3, 85e3)[0]


def cloud_of(
    signals, image, estimates, elements, sonar, pose, profile, *,
    picking=PEAKS, placing=STRAIGHT, focus=20.0, direct=None,
):  # fmt: skip
    """The points of the window of an image."""
    beams = None
    if np.isfinite(image.start):
        beams = FocusedDelayAndSum(focus=focus).beams(
            snapshots_of(signals, sonar, image.start, image.stop), elements, sonar
        )
    loudest = float(np.abs(signals.pressure).max(initial=0.0))
    window = ReceivedWindow(elements, sonar, image, beams, loudest, direct or signals, estimates, focus)
    return point_cloud(window, picking, placing, pose, profile)


def silence(elements: Elements, start: float, samples: int, quantum: float = 0.0) -> Signals:
    pressure = np.zeros((elements.count, samples), np.float32)
    return Signals(pressure, start, RATE, quantum, 0, 0)


def hear(
    signals: Signals, elements: Elements, points, delay, amplitude, sound_speed: float = 1540.0, samples: int = 512
) -> Signals:
    """Add pulses that leave `points` (point, xyz) at `delay` (point,) s with `amplitude` (point,) at 1 m.

    They are put into one stretch of `samples` about the middle of their arrivals, where they must fit.
    """
    q, points = elements.position, np.atleast_2d(np.asarray(points, float))
    r = np.linalg.norm(points[:, None] - q, axis=2)
    arrival = np.atleast_1d(delay)[:, None] + r / sound_speed
    first = round((0.5 * (arrival.min() + arrival.max()) - signals.start) * RATE) - samples // 2
    f = np.fft.rfftfreq(samples, 1 / RATE)
    bins = np.flatnonzero((f > 22e3) & (f < 88e3))
    late = arrival - signals.start - first / RATE
    wave = np.atleast_1d(amplitude)[:, None] / r * np.exp(-2j * np.pi * f[bins[0]] * late)
    turn = np.exp(-2j * np.pi * f[1] * late)
    few = len(points) <= 4
    u = points[:, None] - q if few else points[:, None]  # each sensor's own direction, or the array's
    u = u / np.linalg.norm(u, axis=2, keepdims=True)
    spectrum = np.zeros((elements.count, len(f)), complex)
    for k in bins:
        face = np.sinc(f[k] * elements.face / sound_speed * u[..., 1]) * np.sinc(
            f[k] * elements.face / sound_speed * u[..., 2]
        )
        spectrum[:, k] = np.sum(face * wave, axis=0) if few else face[:, 0] @ wave
        wave *= turn
    spectrum *= pulse_spectrum(f) * RATE * elements.gain[:, None]
    heard = signals.pressure.astype(float)
    a, b = max(first, 0), min(first + samples, heard.shape[1])
    heard[:, a:b] += np.fft.irfft(spectrum, samples, axis=1)[:, a - first : b - first]
    return Signals(heard.astype(np.float32), signals.start, RATE, signals.quantum, 0, 0)


def hear_direct(
    elements: Elements, source, sound_speed: float = 1540.0, noise: float = 0.0, random=None, samples: int = 800
) -> Signals:
    """A snap at `source` (xyz), sonar frame, at time 0; Gaussian noise of standard deviation `noise` (Pa)."""
    middle = np.linalg.norm(source) / sound_speed
    start = round((middle - 0.3 * samples / RATE) * RATE) / RATE
    signals = hear(silence(elements, start, samples), elements, source, 0.0, 1.0, sound_speed)
    return add_noise(signals, noise, random)


def add_noise(signals: Signals, noise: float, random) -> Signals:
    if noise == 0:
        return signals
    rough = signals.pressure + noise * random.standard_normal(signals.pressure.shape, dtype=np.float32)
    return Signals(rough.astype(np.float32), signals.start, RATE, signals.quantum, 0, 0)


def hear_echoes(
    elements: Elements, source, points, amplitude, sound_speed: float = 1540.0
) -> tuple[Signals, float, float]:
    """A snap at `source` at time 0 and its echoes from `points` with scattering amplitudes (point,) in m.

    Also first and last echo (s) at the array centre.
    """
    source, points = np.asarray(source, float), np.atleast_2d(np.asarray(points, float))
    direct = np.linalg.norm(source) / sound_speed
    out = np.linalg.norm(points - source, axis=1)
    back = (out + np.linalg.norm(points, axis=1)) / sound_speed
    start = round((direct - 1.5e-3) * RATE) / RATE
    samples = int((back.max() - start + 3e-3) * RATE)
    signals = hear(silence(elements, start, samples), elements, source, 0.0, 1.0, sound_speed)
    together = np.ptp(back) < 4e-3  # in one stretch, where they fit
    for some in [slice(None)] if together else [slice(n, n + 1) for n in range(len(points))]:
        signals = hear(
            signals, elements, points[some], out[some] / sound_speed, (amplitude / out)[some], sound_speed, samples=1024
        )
    return signals, float(back.min()), float(back.max())
