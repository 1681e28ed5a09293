"""Echoes in the beams over threshold: when each comes after the direct pulse, and whether it is that beam's own.

The beams are compared with the direct pulse as the same array hears it, so that the snap's own waveform, the filter and
the clock cancel: what is left is the delay.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.fft import ifft, next_fast_len
from scipy.ndimage import maximum_filter1d

from sonarsynth.conventions import Floats, Ints, direction
from sonarsynth.equations.arrays.beams import beam_spectra, lattice_beam_spectra
from sonarsynth.equations.arrays.gates import fast_length, frequency_spacing, gate_samples, gated_spectra
from sonarsynth.products import EnergyImage, Signals, SourceEstimates
from sonarsynth.ranging import ranging_kernels
from sonarsynth.ranging.location import pulse_times
from sonarsynth.ranging.location.plane_waves import PlaneWaveFit
from sonarsynth.ranging.location.pulse_times import Complexes
from sonarsynth.receiver import Elements, Sonar

MAX_BEAMS = 16384
"""No more beams are ranged, the loudest of them: a bound on memory where a whole image is loud."""
BEAMS_AT_ONCE = 512
OVERSAMPLING = 4
"""Delays of a profile for each that its bandwidth needs."""
WHITENING = 0.03
"""Share of the pulse's largest power density below which the spectrum is no more flattened (-15 dB)."""
GHOST = 8.0
"""An echo is a ghost or a side lobe where another beam holds this many dB more at the same delay."""
NOISE = 16.0
"""An echo must stand this many dB above the median of its own beam: noise does so once in 10^12 samples."""
EXTENT = 0.05
"""Share of a profile's peak above which it is echo: how far that spreads is the depth of the target in the beam."""
OWN_WIDTH = 0.3
"""Standard angle between a beam and the echo that is loudest in it, in half widths."""
INTERFERENCE = 0.5
"""Standard error of a peak's delay where echoes overlap, in units of the resolution."""
RESIDUE = 1e-6
"""Of the loudest pressure: what single precision and the cut tail of a pulse (1e-7 of its peak) may leave anywhere."""


@dataclass(frozen=True, eq=False)
class Profiles:
    """Energy against delay of some beams: the echo with the pulse's waveform taken out."""

    row: Ints  # (beam,) elevation index
    column: Ints  # (beam,) azimuth index
    direction: Floats  # (beam, xyz)
    power: npt.NDArray[np.float32]  # (beam, delay) relative
    first: float  # s after the direct arrival
    step: float  # s
    width: float  # rad: half of the half-power width of a beam
    resolution: float  # s: 1/(2 pi beta), beta the root mean square bandwidth


@dataclass(frozen=True, eq=False)
class Echoes:
    """One echo a beam: the peak of its profile. NaN delay where there is none of its own."""

    delay: Floats  # (beam,) s after the direct arrival
    delay_error: Floats  # (beam,) s
    angle_error: Floats  # (beam,) rad: how far from the beam the echo may come from
    extent: Floats  # (beam,) s: root mean square distance from the peak of all echo in the beam


def over_threshold(image: EnergyImage, threshold: float, loudest: float = 0.0) -> tuple[tuple[Ints, Ints], int]:
    """Rows and columns of the beams within `threshold` dB of the loudest, none in silence or where none was heard; and
    how many are left out, the faintest of more than `MAX_BEAMS`.

    loudest: largest pressure (Pa) in the signals. An image no louder than `RESIDUE` of it all through the window is
    what rounding and the tail of the direct pulse leave, not an echo.
    """
    energy = np.where(np.isfinite(image.energy), image.energy, 0.0)
    peak = float(energy.max(initial=0.0))
    if not peak > (RESIDUE * loudest) ** 2 * (image.stop - image.start):
        return (np.zeros(0, np.int64), np.zeros(0, np.int64)), 0
    keep = energy >= peak * 10 ** (-threshold / 10)
    over = int(keep.sum())
    if over > MAX_BEAMS:
        keep &= energy >= np.partition(energy, -MAX_BEAMS, axis=None)[-MAX_BEAMS]
    row, column = np.nonzero(keep)
    return (row, column), over - len(row)


def direct_spectrum(
    signals: Signals, estimates: SourceEstimates, elements: Elements, sonar: Sonar, length: int
) -> Complexes:
    """Spectrum (bin,) in Pa s of the direct pulse at the array centre, without the face, about `estimates.time`.

    At the frequencies of an FFT of `length` samples.
    """
    c, front = sonar.assumed_sound_speed, PlaneWaveFit.of(estimates)
    aligned = pulse_times.align(signals, elements, sonar.band, front.delays(elements, c), whole=True)
    wave = pulse_times.waveform(aligned, elements, c, front.direction, front.curvature, front.time)
    return pulse_times.template_spectrum(wave.template, length)


def range_profiles(
    signals: Signals,
    image: EnergyImage,
    estimates: SourceEstimates,
    elements: Elements,
    sonar: Sonar,
    beams: tuple[Ints, Ints],
    focus: float | None,
    direct: Signals,
) -> Profiles:
    """Profiles of the beams (row, column): matched to the direct pulse as this beam would hear it, whitened, tapered.

    With W the direct pulse at the array centre and D the face directivity towards the beam, the profile is the envelope
    of the inverse transform of B conj(W) D/(|W|^2 + w max|W|^2): all of the band counts alike, which is as sharp as the
    band allows in delay, and sharper in angle than the snap's own falling spectrum. `direct`: signals with the direct
    pulse in them.
    """
    rate, c = signals.sampling_frequency, sonar.assumed_sound_speed
    first, count = gate_samples(image.start, image.stop, signals.start, rate, signals.pressure.shape[1])
    band = (sonar.band.low, sonar.band.high)
    f, spectra = gated_spectra(signals.pressure, rate, first, count, band)
    spacing = frequency_spacing(count, rate)
    lowest = round(f[0] / spacing)
    wave = direct_spectrum(direct, estimates, elements, sonar, fast_length(count))[lowest : lowest + len(f)]
    density = np.abs(wave) ** 2
    place = (f - band[0]) / (band[1] - band[0])
    taper = np.sin(np.pi * np.clip(place, 0.0, 1.0)) ** 2
    matched = wave.conj() * taper / (density + WHITENING * density.max()) if density.max() > 0 else 0 * wave
    length = next_fast_len(OVERSAMPLING * len(f))
    step = 1 / (length * spacing)
    row, column = beams
    u = direction(image.azimuth[column], image.elevation[row])
    power = np.empty((len(u), min(int(count / rate / step) + 1, length)), np.float32)
    for part in range(0, len(u), BEAMS_AT_ONCE):
        here = slice(part, part + BEAMS_AT_ONCE)
        sine = u[here] * (elements.face / c)
        face = ranging_kernels.face_responses(sine[:, 1], sine[:, 2], f[0], spacing, len(f))
        beam = _beams(spectra, f, elements, u[here], c, focus)
        echo = ifft(beam * (face * matched).astype(np.complex64), length, axis=1)[:, : power.shape[1]]
        power[here] = echo.real**2 + echo.imag**2
    spread = np.sum(taper**2)
    centre = f @ taper**2 / spread
    beta = np.sqrt(max((f - centre) ** 2 @ taper**2 / spread, spacing**2))
    start = signals.start + first / rate - float(estimates.time[0])
    return Profiles(row, column, u, power, start, step, _half_width(elements, centre / c), 1 / (2 * np.pi * beta))


def _beams(
    spectra: npt.NDArray[np.complex64], f: Floats, elements: Elements, u: Floats, c: float, focus: float | None
) -> npt.NDArray[np.complex64]:
    """Spectra (beam, bin) of beams: by rows and columns on a lattice, sensor by sensor elsewhere."""
    if not elements.on_lattice:
        return beam_spectra(spectra, f, elements.position, elements.gain, u, c, focus)
    shape = elements.columns, elements.rows
    return lattice_beam_spectra(
        spectra,
        f,
        elements.column,
        elements.row,
        shape,
        pitch=elements.pitch,
        gain=elements.gain,
        directions=u,
        sound_speed=c,
        focus=focus,
    )


def _half_width(elements: Elements, wavenumber: float) -> float:
    """Angle (rad) at which a beam of `wavenumber` (1/m) is down 3 dB, from the second moment of the aperture.

    0.808/(k s), s the root mean square extent in y and z: exact for a uniform disc (2 J1(x)/x at x = 1.616).
    """
    live = elements.position[elements.gain != 0][:, 1:]
    extent = float(np.sqrt(np.mean((live - live.mean(axis=0)) ** 2))) if len(live) else 0.0
    return min(0.808 / (2 * np.pi * wavenumber * extent), 1.0) if extent > 0 else 1.0


def pick(profiles: Profiles, image: EnergyImage, locality: float) -> Echoes:
    """The peak of every profile, kept where it is the beam's own.

    At the delay of its peak, no beam within a beam width may hold `locality` dB more, or the echo comes from there; and
    no beam at all `GHOST` dB more, or it comes through a side lobe or a grating lobe; and it must stand out of the
    noise. Nearer to an end of the profile than half a pulse (`pulse_times.PULSE_HALF`) a peak is what the window left
    of an echo, whose own peak may be outside: that is none.
    """
    power, count = profiles.power, len(profiles.power)
    rows = np.arange(count)
    top = np.clip(power.argmax(axis=1), 1, power.shape[1] - 2)
    own = power[rows, top]
    place, _ = pulse_times.parabola(*(np.sqrt(power[rows, top + i]) for i in (-1, 0, 1)))
    near = np.maximum(_loudest_near(profiles, image, top), own)
    anywhere = maximum_filter1d(power.max(axis=0), _about(profiles) * 2 + 1)[top]
    noise = np.median(power[:, ::OVERSAMPLING], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        excess = 10 * np.log10(near / own)
        good = (own > 0) & (excess <= locality) & (own * 10 ** (GHOST / 10) >= anywhere)
        good &= own >= noise * 10 ** (NOISE / 10)
        good &= np.minimum(top, power.shape[1] - 1 - top) * profiles.step >= pulse_times.PULSE_HALF
        off_beam = profiles.width * np.hypot(np.sqrt(excess / 3), OWN_WIDTH)
        jitter = profiles.resolution * np.hypot(np.sqrt(0.5 * noise / own), INTERFERENCE)
    delay = profiles.first + (top + place) * profiles.step
    return Echoes(np.where(good, delay, np.nan), jitter, off_beam, _extent(profiles, top, own))


def _extent(profiles: Profiles, top: Ints, own: npt.NDArray[np.float32]) -> Floats:
    """Root mean square distance (beam,) in s of a beam's echo from its peak; 0 for one glint, but for its own width."""
    echo = np.where(profiles.power >= EXTENT * own[:, None], profiles.power, np.float32(0.0))
    steps = np.arange(echo.shape[1], dtype=np.float32)
    total = np.maximum(echo.sum(axis=1), np.finfo(np.float32).tiny)
    mean = echo @ steps / total
    square = np.einsum("bt,bt->b", echo, (steps - mean[:, None]) ** 2) / total
    spread = profiles.step * np.sqrt(square + (mean - top) ** 2)
    return np.asarray(np.sqrt(np.maximum(spread**2 - profiles.resolution**2, 0.0)))


def _about(profiles: Profiles) -> int:
    """Steps of delay within which two beams hear the same echo."""
    return max(round(0.7 * profiles.resolution / profiles.step), 1)


def _loudest_near(profiles: Profiles, image: EnergyImage, top: Ints) -> npt.NDArray[np.float32]:
    """Largest power (beam,), about the delay of each beam's own peak, in the beams within a beam width of it."""
    rows, columns = image.energy.shape
    index = np.full((rows, columns), -1)
    index[profiles.row, profiles.column] = np.arange(len(top))
    reach = 2 * profiles.width
    up, across = (_cells(grid, reach) for grid in (image.elevation, image.azimuth))
    return np.asarray(
        ranging_kernels.loudest_near(
            profiles.power,
            top,
            _about(profiles),
            profiles.row,
            profiles.column,
            index,
            up,
            across,
            profiles.direction,
            reach,
        )
    )


def _cells(grid: Floats, reach: float) -> int:
    """Grid cells within `reach` (rad), one at least, where there is more than one."""
    step = float(grid[1] - grid[0]) if len(grid) > 1 else np.inf
    return min(max(int(np.ceil(reach / step)), 1), len(grid) - 1)
