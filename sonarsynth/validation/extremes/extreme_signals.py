"""Signals at the ends of what there is: delays, windows, bands, loudness, numbers of hydrophones."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.reverberation.bottom_strength import GRAIN_SIZE, Angles, sediment
from sonarsynth.imaging import FocusedDelayAndSum
from sonarsynth.imaging.image_window import snapshots_of
from sonarsynth.ranging import IsovelocityPlacing, Peaks, SensorDelays
from sonarsynth.ranging.clouds import point_cloud
from sonarsynth.ranging.location.locating_method import unlocatable
from sonarsynth.ranging.received_window import ReceivedWindow
from sonarsynth.receiver import POINT, Band, BeamGrid, LowPass, PlanarLattice, PositionTable, Sonar, elements
from sonarsynth.scattering.boundaries import BoundarySite, WindySurface
from sonarsynth.scattering.isotropic import Isotropic
from sonarsynth.signals import DirectSum, GriddedSynthesis
from sonarsynth.signals.segments import Reception
from sonarsynth.sources.snap_models import Gabor, Ricker
from sonarsynth.state import Receiver, Survey
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Sphere
from sonarsynth.validation.extremes.outcomes import Case, CaseResult, holds, off, refused, together
from sonarsynth.validation.extremes.plain_scenes import (
    POSE,
    PROFILE,
    PULSE,
    RATE,
    SONAR,
    C,
    body,
    direct,
    ricker,
    snap,
    synthesised,
    times,
    traced,
)

if TYPE_CHECKING:
    from sonarsynth.products import Signals
    from sonarsynth.signals import SignalSynthesis

TWO = elements(PositionTable(positions=((0.0, 0.2, 0.1),) * 2))
FEW = elements(PlanarLattice(columns=4, rows=4, pitch=0.1, face=0.0))
FINE = 1e-4
"""Error allowed to signals, of their peak: what `GriddedSynthesis` promises."""


def methods() -> tuple[SignalSynthesis, ...]:
    """The fast synthesis and the exact one."""
    return GriddedSynthesis(), DirectSum()


def _against(signals: Signals, exact: Floats, allowed: float = FINE) -> CaseResult:
    """Signals against what they must be, of its peak; none may be outside."""
    error = off(np.abs(signals.pressure - exact).max() / np.abs(exact).max(), allowed, "of peak")
    return CaseResult(error.text, error.ok and signals.outside == 0)


def _delays() -> CaseResult:
    results = []
    for delay in (1e-6, 1e-3, 1.0, 100.0):
        position = (delay * C, 0.0, 0.0)
        snaps = (snap(position),)
        start, samples = delay - 4e-4, 200
        arrivals = traced(snaps, POINT)
        exact = direct(POINT, position, times(start, samples))
        results += [_against(synthesised(m, arrivals, snaps, POINT, start, samples), exact) for m in methods()]
    return together(results)


def _long() -> CaseResult:
    """One window that holds both."""
    places = (1e-6 * C, 0.0, 0.0), (0.0, 100.0 * C, 0.0)
    snaps = tuple(snap(p, gain=float(np.linalg.norm(p))) for p in places)
    start, samples = -4e-4, round((100.0 + 8e-4) * RATE)
    signals = synthesised(methods()[0], traced(snaps, POINT), snaps, POINT, start, samples)
    results = []
    for delay in (1e-6, 100.0):
        first = max(round((delay - 4e-4 - start) * RATE), 0)
        span = slice(first, first + 190)
        exact = ricker(start + np.arange(samples)[span] / RATE - delay)
        results.append(off(np.abs(signals.pressure[0, span] - exact).max(), FINE, "of peak"))
        signals.pressure[0, span] = 0.0
    return together(results, off(np.abs(signals.pressure).max(), FINE, "of peak", "elsewhere"))


def _one_sample() -> CaseResult:
    position = (9.0, 2.0, -3.0)
    snaps = (snap(position),)
    arrivals, results, peak = traced(snaps, FEW), [], 1.0 / float(np.linalg.norm(position))
    for late in (-2e-5, 0.0, 1.3e-5, 1e-4):
        start = float(np.linalg.norm(position)) / C + late
        exact = direct(FEW, position, times(start, 1))
        for method in methods():
            signals = method.signals(arrivals, snaps, Reception(FEW, SONAR, None, start, 1))
            results.append(off(np.abs(signals.pressure - exact).max() / peak, FINE, "of peak"))
    short = synthesised(methods()[0], arrivals, snaps, FEW, start, 1)
    image = refused(lambda: FocusedDelayAndSum().image(short, FEW, SONAR, start, start), "window")
    return together(results, image)


def _bands() -> CaseResult:
    results = []
    for frequency, rate, stop in ((50.0, 2e5, 9e4), (5e3, 2e5, 9e4), (2e5, 1e7, 2e6), (1e7, 1e8, 40e6)):
        sonar = Sonar(sampling_frequency=rate, filter=LowPass(cutoff=stop, transition=0.1 * stop))
        position = (9.0, 2.0, -3.0)
        snaps = (snap(position, model=Ricker(frequency=frequency)),)
        half = 2.0 / frequency + 2.0 * FEW.aperture / C
        samples = round(2.0 * half * rate)
        start = float(np.linalg.norm(position)) / C - half
        exact = direct(FEW, position, times(start, samples, rate), frequency)
        signals = synthesised(methods()[0], traced(snaps, FEW), snaps, FEW, start, samples, sonar)
        results.append(_against(signals, exact))
    return together(results)


def _narrow() -> CaseResult:
    """A thousand cycles: the tone in its Gaussian, whose width at half its height is theirs."""
    f, cycles, position = 50e3, 1000.0, (9.0, 2.0, -3.0)
    snaps = (snap(position, model=Gabor(frequency=f, cycles=cycles)),)
    r, samples = float(np.linalg.norm(position)), 60_000
    start = r / C - 0.5 * samples / RATE
    signals = synthesised(methods()[0], traced(snaps, POINT), snaps, POINT, start, samples)
    t = times(start, samples) - r / C
    exact = np.exp(-4.0 * np.log(2.0) * (t * f / cycles) ** 2) * np.cos(2.0 * np.pi * f * t) / r
    return _against(signals, exact)


def _loud_and_faint() -> CaseResult:
    """100 dB: a strength of 1 and of 1e-5, at places heard apart; each against what is heard of it alone."""
    source = np.array([6.0, -4.0, -3.0])
    snaps, results = (snap(source),), []
    mesh = mesh_of(Sphere(radius=1e-3))
    bodies = body(mesh, (8.0, 0.0, 0.0)), body(mesh, (15.0, 1.0, 0.0))
    laws = Isotropic(strength=1.0), Isotropic(strength=1e-5)
    both, alone = traced(snaps, FEW, bodies, laws), traced(snaps, FEW, bodies[1:], laws[1:])
    both, alone = (x.select(~x.direct) for x in (both, alone))
    late = float(alone.delay.mean())
    for method in methods():
        signals, exact = (synthesised(method, x, snaps, FEW, late - 4e-4, 200) for x in (both, alone))
        error = np.abs(signals.pressure - exact.pressure).max() / np.abs(exact.pressure).max()
        results.append(off(error, 1e-3, "of peak"))
    counts = [int((both.target == n).sum()) for n in (0, 1)]
    return together(holds(min(counts) > 0, f"{counts} paths"), results)


def _silence() -> CaseResult:
    quiet = synthesised(methods()[0], traced((), FEW), (), FEW, 0.0, 2000)
    sonar = Sonar(array=PlanarLattice(columns=4, rows=4, pitch=0.1, face=0.0), beams=BeamGrid(azimuths=5, elevations=5))
    estimates = SensorDelays().locate(quiet, Receiver(POSE, FEW, sonar), Survey(100.0, PROFILE), 1)
    image = FocusedDelayAndSum().image(quiet, FEW, sonar, 1e-3, 6e-3)
    beams = FocusedDelayAndSum().beams(snapshots_of(quiet, sonar, 1e-3, 6e-3), FEW, sonar)
    window = ReceivedWindow(FEW, sonar, image, beams, 0.0, quiet, estimates)
    cloud = point_cloud(window, Peaks(), IsovelocityPlacing(), POSE, PROFILE)
    return together(
        holds(not quiet.pressure.any() and quiet.outside == 0, "no pressure"),
        holds(not image.energy.any(), "no energy in any beam"),
        holds(all(np.isnan(v).all() for v in vars(estimates).values() if v.dtype.kind == "f"), "no snap found: NaN"),
        holds(len(cloud) == 0, "no point"),
    )


def _few_sensors() -> CaseResult:
    position, results = (9.0, 2.0, -3.0), []
    snaps, start = (snap(position),), 0.004
    for array, reason in ((POINT, "1 live hydrophone"), (TWO, "2 live hydrophones")):
        signals = synthesised(methods()[0], traced(snaps, array), snaps, array, start, 1000)
        results.append(_against(signals, direct(array, position, times(start, 1000))))
        estimates = SensorDelays().locate(signals, Receiver(POSE, array, SONAR), Survey(100.0, PROFILE), 1)
        refusal = unlocatable(array) or ""
        results.append(holds(bool(np.isnan(estimates.azimuth).all()) and reason in refusal, f"no bearing: {refusal}"))
        if array is TWO:
            results.append(holds(bool((signals.pressure[0] == signals.pressure[1]).all()), "both the same"))
    return together(*results)


def _ten_thousand() -> CaseResult:
    """Every hydrophone; and the beam that is focused at the snap, whose energy in the band is the pulse's over r^2."""
    from scipy.integrate import quad

    array = PlanarLattice(columns=100, rows=100, pitch=0.01, face=0.0)
    band = Band(low=10e3, high=40e3)
    sonar = Sonar(
        array=array, sampling_frequency=RATE, filter=LowPass(cutoff=110e3), band=band, assumed_sound_speed=C,
        beams=BeamGrid(azimuths=21, elevations=21, azimuth_span=0.5, elevation_span=0.5),
    )  # fmt: skip
    many, position = elements(array), (15.0, 0.0, 0.0)
    snaps, start, samples = (snap(position),), 15.0 / C - 1e-3, 500
    signals = synthesised(methods()[0], traced(snaps, many), snaps, many, start, samples, sonar)
    exact = _against(signals, direct(many, position, times(start, samples)))
    image = FocusedDelayAndSum(focus=15.0).image(signals, many, sonar, start, start + (samples - 1) / RATE)
    f0 = PULSE.frequency

    def power(f: float) -> float:
        return float((2.0 / np.sqrt(np.pi) * f**2 / f0**3 * np.exp(-((f / f0) ** 2))) ** 2)

    energy = 2.0 * quad(power, band.low, band.high)[0] / 15.0**2
    loudest = int(np.argmax(image.energy))
    return together(
        exact,
        holds(loudest == 10 * 21 + 10, "the loudest beam is the one ahead"),
        off(image.energy[10, 10] / energy - 1.0, 0.02, what="its energy"),
    )


def _strengths() -> CaseResult:
    """Of every sediment, and of surfaces from calm to 60 m/s, along the boundary, straight up, and between."""
    edges = np.array([0.0, 1e-12, 1e-6, 0.5, 1.0 - 1e-12, 1.0])
    angles = Angles(*(a.ravel() for a in np.meshgrid(edges, edges, [-1.0, 0.0, 1.0])))
    k = 2.0 * np.pi * 50e3 / C
    sites = [BoundarySite(50e3, k, np.ones_like, wind, rms_height=0.1) for wind in (0.0, 0.3, 0.69, 1.0, 11.0, 60.0)]
    values = [sediment(angles, k, name) for name in GRAIN_SIZE]
    values += [WindySurface().strength(angles, site) for site in sites]
    along = np.array([x[(angles.sine_in == 0.0) & (angles.sine_out == 0.0) & (angles.forward < 0.0)] for x in values])
    return together(
        holds(all(np.isfinite(x).all() and (x >= 0.0).all() for x in values), "finite and not negative"),
        holds(float(along.max()) < 1e-5, f"at most {along.max():.1g} along the boundary"),
    )


EXACT = "the pulse over r at its time, to 1e-4"
CASES = (
    Case("delays of 1 us to 100 s", EXACT, _delays),
    Case("1 us and 100 s in one window", f"{EXACT}; silence between", _long, slow=True),
    Case("one-sample windows", f"{EXACT}; no image, with the reason", _one_sample),
    Case("bands of 50 Hz to 10 MHz", EXACT, _bands),
    Case("a narrow band: 1000 cycles", "the tone in its Gaussian, to 1e-4", _narrow),
    Case("one loud and one faint target, 100 dB apart", "the faint one as it is alone, to 1e-3", _loud_and_faint),
    Case("scattering at grazing 0 and 90 degrees, wind of 0 to 60 m/s", "finite, none along the boundary", _strengths),
    Case("silence", "no pressure, no energy; NaN for what is not there", _silence),
    Case("one sensor, two at one place", f"{EXACT}; no bearing, with the reason", _few_sensors),
    Case("10 000 sensors", f"{EXACT}; the energy of the focused beam by Parseval", _ten_thousand, slow=True),
)
