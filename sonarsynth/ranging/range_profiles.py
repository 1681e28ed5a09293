"""Power against delay in the beams over threshold: the echo with the pulse's own waveform taken out.

The beams are compared with the direct pulse as the same array hears it, so that the snap's own waveform, the filter and
the clock cancel: what is left is the delay.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.fft import ifft, irfft, next_fast_len, rfft

from sonarsynth.conventions import Complexes, Floats, Ints, direction
from sonarsynth.equations.arrays.apertures import half_power_angle, live_gain
from sonarsynth.equations.arrays.gates import fast_length
from sonarsynth.equations.arrays.spherical_wave import parabola
from sonarsynth.products import EnergyImage, Signals, SourceEstimates
from sonarsynth.products.steered_spectra import PARTS
from sonarsynth.ranging import ranging_kernels
from sonarsynth.ranging.location import pulse_times
from sonarsynth.ranging.location.plane_waves import PlaneWaveFit
from sonarsynth.ranging.received_window import ReceivedWindow
from sonarsynth.receiver import Band, Elements, Sonar

MAX_BEAMS = 16384
"""No more beams are ranged, the loudest of them: a bound on memory where a whole image is loud."""
SAMPLES_AT_ONCE = 65536
"""Of beams that are transformed together, in the cache: more at once would need memory that is given back, and taken
again, in every frame."""
OVERSAMPLING = 4
"""Delays of a profile for each that its bandwidth needs: two of a transform, and one more after each."""
HALFWAY = np.array([0.605571, -0.133738, 0.032692, -0.004536], np.float32)
"""Taps that make these: by least squares over a band that is tapered as profiles are, of which they err by 3.5e-5 rms.
The transform of all of them takes two thirds longer."""
WHITENING = 0.03
"""Share of the pulse's largest power density below which the spectrum is no more flattened (-15 dB)."""
OWN = 0.1 * WHITENING
"""Share of that below which a pulse counts as having nothing at a frequency: flattening leaves 0.1 of its amplitude."""
EDGE = 0.1
"""Share of the band, at either end, within which a pulse may end and be tapered over all of the band: by 0.1 there."""
FLAT = 0.75
"""Share of the window about a pulse in which that is whole, as `pulse_times.align` cuts."""
ENOUGH, ALIKE = 168, 0.99
"""Sensors that the direct pulse is taken from, where it is so much of all that they hear about it; else all."""
RESIDUE = 1e-7
"""Of the loudest pressure: what the tail of the direct pulse may still be in the echo window, as synthesis cuts it."""

Powers = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Moments:
    """Of what an echo, and of what white noise, has in a profile: how sharp one is, how rough the other."""

    echo_band: float  # Hz: root mean square distance of the frequencies of an echo's amplitude from their mean
    noise_band: float  # Hz: of those of noise, by its power, from the mean of an echo
    noise_own_band: float  # Hz: of noise, about its own mean
    echo_frequency: float  # Hz: root mean square frequency of an echo's amplitude
    noise_frequency: float  # Hz: of noise, by its power


@dataclass(frozen=True, eq=False)
class EchoFilter:
    """What makes a profile of a beam."""

    received: ReceivedWindow
    share: Floats  # (bin,) of the amplitude of an echo
    matched: Complexes  # (bin,) the pulse's own waveform taken out
    taper: Floats  # (bin,) of the band
    unity: float  # power in a profile of an echo that is as strong as the direct pulse
    length: int  # of the transform to delays
    count: int  # of delays that are in the window

    @property
    def step(self) -> float:
        """Step (s) of delays."""
        return 0.5 / (self.length * self.received.beams.snapshots.spacing)

    def profiles(self, u: Floats) -> tuple[npt.NDArray[np.complex64], Powers, Powers, Powers]:
        """Spectra (beam, bin) of the profiles of beams (beam, xyz), these, powers (beam, delay), their sums (beam,) and
        the largest of all beams (delay,)."""
        window, sonar = self.received.beams.snapshots, self.received.sonar
        sine = u * (self.received.elements.face / sonar.assumed_sound_speed)
        spectra = self.received.beams.spectra(u)
        power, total = np.empty((len(u), self.count), np.float32), np.empty(len(u), np.float32)
        loudest = np.zeros(self.count, np.float32)
        room = np.empty((max(SAMPLES_AT_ONCE // self.length, 1), self.length), np.complex64)
        for low in range(0, len(u), len(room)):
            some = slice(low, low + len(room))
            steered, bins = spectra[some], (window.frequency[0], window.spacing)
            padded = room[: len(steered)]
            ranging_kernels.match(steered, sine[some, 1], sine[some, 2], *bins, self.share, self.matched, padded)
            waves = ifft(padded, axis=1, overwrite_x=True)
            ranging_kernels.powers(waves, HALFWAY, power[some], total[some], loudest)
        return spectra, power, total, loudest


@dataclass(frozen=True, eq=False)
class Profiles:
    """Power against delay of some beams: the echo with the pulse's waveform taken out."""

    row: Ints  # (beam,) elevation index
    column: Ints  # (beam,) azimuth index
    direction: Floats  # (beam, xyz)
    spectra: npt.NDArray[np.complex64]  # (beam, bin) of which they are made
    power: Powers  # (beam, delay) relative
    total: Powers  # (beam,) sum over delays
    loudest: Powers  # (delay,) of all beams
    first: float  # s after the direct arrival
    step: float  # s
    width: float  # rad: half of the half-power width of a beam
    resolution: float  # s: 1/(2 pi beta), beta the root mean square bandwidth
    moments: Moments
    filter: EchoFilter

    @property
    def about(self) -> int:
        """Steps of delay within which two beams hear the same echo."""
        return max(round(0.7 * self.resolution / self.step), 1)


def over_threshold(received: ReceivedWindow, threshold: float) -> npt.NDArray[np.bool_]:
    """The beams (elevation, azimuth) within `threshold` dB of the loudest; none in silence or where none was heard."""
    energy = np.where(np.isfinite(received.image.energy), received.image.energy, 0.0)
    peak = float(energy.max(initial=0.0))
    if not peak > residue(received):
        return np.zeros(energy.shape, bool)
    return np.asarray(energy >= peak * 10 ** (-threshold / 10))


def residue(received: ReceivedWindow) -> float:
    """Energy (Pa2 s) of `RESIDUE` of the loudest pressure for as long as the direct pulse lasts, as the band lets it:
    what that leaves in a beam, no echo. Single precision leaves less, for echoes are summed apart from it."""
    lasts = 2.0 * (received.pulse + 1.0 / (received.sonar.band.high - received.sonar.band.low))
    return (RESIDUE * received.loudest) ** 2 * lasts


def loudest_beams(image: EnergyImage, chosen: npt.NDArray[np.bool_]) -> tuple[tuple[Ints, Ints], int]:
    """Rows and columns of some beams, and how many are left out: the faintest of more than `MAX_BEAMS`."""
    over = int(chosen.sum())
    if over > MAX_BEAMS:
        energy = np.where(chosen & np.isfinite(image.energy), image.energy, -1.0)
        chosen = chosen & (energy >= np.partition(energy, -MAX_BEAMS, axis=None)[-MAX_BEAMS])
    row, column = np.nonzero(chosen)
    return (row, column), over - len(row)


def direct_spectrum(
    signals: Signals, estimates: SourceEstimates, elements: Elements, sonar: Sonar, length: int, pulse: float
) -> Complexes:
    """Spectrum (bin,) in Pa s of the direct pulse at the array centre, without the face, about `estimates.time`.

    At the frequencies of an FFT of `length` samples. pulse (s): how long it is heard before and after that time.
    """
    c, front = sonar.assumed_sound_speed, PlaneWaveFit.of(estimates)
    half = max(pulse / FLAT, pulse_times.PULSE_HALF)
    around = half + pulse_times.transit(elements, c) + 2.0 / signals.sampling_frequency
    near, begin = pulse_times.excerpt(signals, front.time, around)
    for rows in (slice(None, None, max(elements.count // ENOUGH, 1)), slice(None)):
        own, some = elements.select(rows), replace(signals, pressure=np.ascontiguousarray(near[rows]), start=begin)
        aligned = pulse_times.cut(some, own.gain, front.delays(own, c), half, None)
        wave = pulse_times.waveform(aligned, own, c, front.direction, front.curvature, front.time)
        heard = np.abs(aligned.spectrum).ravel()
        if len(own.gain) == elements.count or wave.power @ np.abs(wave.template) ** 2 > ALIKE * heard @ heard:
            break
    return template_spectrum(wave.template, length)


def template_spectrum(template: Complexes, length: int) -> Complexes:
    """A template (bin,) in Pa s of all frequencies up to half the sampling frequency, at those of an FFT of `length`.

    It is short, so its spectrum is smooth: its waveform is transformed anew, exactly. Time 0 stays where it was.
    """
    half = len(template) - 1
    centred = template * (-1.0) ** np.arange(half + 1)  # time 0 at the middle sample
    wave = np.zeros(length)
    np.add.at(wave, (np.arange(2 * half) - half) % length, irfft(centred, 2 * half))
    return np.asarray(rfft(wave), np.complex128)


def echo_filter(received: ReceivedWindow) -> EchoFilter:
    """What makes profiles of beams: matched to the direct pulse as this beam would hear it, whitened, tapered.

    With W the direct pulse at the array centre and D the face directivity towards the beam, the profile is the envelope
    of the inverse transform of B conj(W) D/(|W|^2 + w max|W|^2): all of the band counts alike, which is as sharp as the
    band allows in delay, and sharper in angle than the snap's own falling spectrum. A pulse that has less than the band
    is tapered over what it has: steep ends of its spectrum would ring. D is divided by its root mean square over an
    echo's spectrum, or an echo would be loudest where the face hears best, nearer to the axis.
    """
    window, sonar, elements = received.beams.snapshots, received.sonar, received.elements
    f, spacing = window.frequency, window.spacing
    samples = fast_length(window.samples)
    wave = direct_spectrum(received.direct, received.estimates, elements, sonar, samples, received.pulse)
    wave = wave[np.rint(f * samples / window.sampling_frequency).astype(int)]
    taper, matched = matched_filter(f, wave, spacing, sonar.band)
    share = np.abs(wave * matched) + np.finfo(float).tiny
    parts = 2 * PARTS // max(round(spacing * samples / window.sampling_frequency), 1)
    length = parts * next_fast_len(-(-OVERSAMPLING // 2 * len(f) // parts))
    count = min(int(window.duration / (0.5 / (length * spacing))) + 1, 2 * length)
    unity = float((share.sum() * window.sampling_frequency / length) ** 2)  # beams are in Pa, the pulse in Pa s
    return EchoFilter(received, share / share.sum(), matched, taper, unity, length, count)


def range_profiles(received: ReceivedWindow, beams: tuple[Ints, Ints]) -> Profiles:
    """Profiles of the beams (row, column) by their `echo_filter`."""
    window, (row, column), echoes = received.beams.snapshots, beams, echo_filter(received)
    u = direction(received.image.azimuth[column], received.image.elevation[row])
    f, power = window.frequency, echoes.taper**2 / np.sum(echoes.taper**2)
    centre = float(f @ power)
    beta = np.sqrt(max(float((f - centre) ** 2 @ power), window.spacing**2))
    return Profiles(
        row,
        column,
        u,
        *echoes.profiles(u),
        first=window.start - float(received.estimates.time[0]),
        step=echoes.step,
        width=half_width(received.elements, centre / received.sonar.assumed_sound_speed),
        resolution=1 / (2 * np.pi * beta),
        moments=_moments(f, echoes.share, np.abs(echoes.matched) ** 2, window.spacing),
        filter=echoes,
    )


def matched_filter(f: Floats, wave: Complexes, spacing: float, band: Band) -> tuple[Floats, Complexes]:
    """Taper (bin,) of a pulse's own part of the band, and what takes its waveform out of echoes (bin,): of its spectrum
    (bin,) at frequencies (bin,) so far (Hz) apart."""
    density = np.abs(wave) ** 2
    low, high = _own_band(f, density, spacing, band)
    taper = np.asarray(np.sin(np.pi * np.clip((f - low) / (high - low), 0.0, 1.0)) ** 2)
    return taper, wave.conj() * taper / (density + WHITENING * density.max()) if density.max() > 0 else 0 * wave


@dataclass(frozen=True)
class StretchedEcho:
    """What ranging makes of an echo that motion made longer or shorter than the direct pulse."""

    late: float  # s: where its profile is largest
    power: float  # there, over that of one like the direct pulse


def stretched_echo(f: Floats, wave: Complexes, stretched: Complexes, band: Band) -> StretchedEcho:
    """Of the spectra of the direct pulse and of the echo: wave, stretched (bin,), at frequencies (bin,)."""
    _, matched = matched_filter(f, wave, f[1] - f[0], band)
    count = 8 * next_fast_len(len(f))
    plain, profile = (np.abs(ifft(of * matched, count)) for of in (wave, stretched))
    top = int(profile.argmax())
    offset, height = parabola(*profile[[top - 1, top, (top + 1) % count]])
    late = (top - count * (top > count / 2) + float(offset)) / (count * (f[1] - f[0]))
    return StretchedEcho(float(late), float((height / plain[0]) ** 2))


def _own_band(f: Floats, density: Floats, spacing: float, band: Band) -> tuple[float, float]:
    """Ends (Hz) of what a pulse has of the band, by its power densities (bin,) at frequencies (bin,) so far (Hz) apart;
    those of the band where it ends next to them, and a taper over the band is small there."""
    loud, beside = f[density >= OWN * density.max()], EDGE * (band.high - band.low)
    low = band.low if loud[0] < band.low + beside else float(loud[0] - spacing)
    return low, band.high if loud[-1] > band.high - beside else float(loud[-1] + spacing)


def _moments(f: Floats, echo: Floats, noise: Floats, spacing: float) -> Moments:
    """Moments of profiles in which an echo has the spectrum `echo` (bin,), and white noise the power `noise` (bin,)."""
    echo, noise = (x / x.sum() if x.sum() > 0.0 else np.full(len(x), 1.0 / len(x)) for x in (echo, noise))
    centre, own = float(f @ echo), float(f @ noise)

    def spread(share: Floats, middle: float) -> float:
        return float(np.sqrt(max(float((f - middle) ** 2 @ share), spacing**2)))

    frequencies = (float((f**2 @ share) ** 0.5) for share in (echo, noise))
    return Moments(spread(echo, centre), spread(noise, centre), spread(noise, own), *frequencies)


@lru_cache(maxsize=16)
def half_width(elements: Elements, wavenumber: float) -> float:
    """`half_power_angle` (rad) by the root mean square extent in y and z together, 1 at most."""
    live = elements.position[elements.gain != 0][:, 1:]
    extent = float(np.sqrt(np.mean((live - live.mean(axis=0)) ** 2))) if len(live) else 0.0
    return min(float(half_power_angle(extent, wavenumber)), 1.0)


@lru_cache(maxsize=16)
def aperture_moments(elements: Elements) -> Floats:
    """Second moments (xyz, xyz) in m2 of the positions of live elements about their centre, by their gains."""
    weight = live_gain(elements.gain)
    about = elements.position - weight @ elements.position
    return np.asarray((weight[:, None] * about).T @ about)
