"""Sources that are hard to locate: each estimate is right within its errors, or is none and says why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import xarray as xr

from sonarsynth.conventions import Floats, azimuth_elevation, direction
from sonarsynth.environment.boundaries import Rigid, SeaBottom
from sonarsynth.geometry import Pose
from sonarsynth.pipeline import render
from sonarsynth.planning import Plan, plan
from sonarsynth.products import REASONS, Signals, SourceEstimates
from sonarsynth.propagation import AutoTracing
from sonarsynth.ranging import SensorDelays
from sonarsynth.receiver import POINT, Band, Elements, PlanarLattice, Sonar, elements
from sonarsynth.recipe import reading
from sonarsynth.state import Emission, FrameContext, Medium, Receiver, Survey
from sonarsynth.tracing.arrivals import trace
from sonarsynth.validation.extremes.outcomes import Case, CaseResult, holds, off, relative, together
from sonarsynth.validation.extremes.plain_scenes import (
    BOTTOM_DEPTH,
    POSE,
    PROFILE,
    PULSE,
    RATE,
    SONAR,
    WATER,
    C,
    direct,
)

LATTICE = PlanarLattice(columns=16, rows=16, pitch=0.08, face=0.0)
BAND = Band(low=25e3, high=85e3)
TONE = 40e3
"""Hz: the centre of the narrow bands."""


def _noisy_signals(
    array: Elements, places: Sequence[Floats], gains: Sequence[float], noise: float, seed: int
) -> Signals:
    """Snaps at one instant at places (xyz) in the sonar frame, with noise (Pa) at each hydrophone."""
    away = np.linalg.norm(places, axis=1)
    start = float(away.min()) / C - 2e-3
    time = start + np.arange(int((float(np.ptp(away)) / C + 4e-3) * RATE)) / RATE
    total = sum(g * direct(array, position.tolist(), time, TONE) for g, position in zip(gains, places, strict=True))
    total = total + noise * np.random.default_rng(seed).standard_normal(np.shape(total))
    return Signals(total.astype(np.float32), start, RATE, 0.0, 0, 0)


def _located(
    signals: Signals, array: Elements, rows: int, band: Band = BAND, *, refraction: bool = False
) -> SourceEstimates:
    sonar = Sonar(array=LATTICE, band=band, sampling_frequency=RATE, assumed_sound_speed=C, sound_speed_error=0.1)
    return SensorDelays(refraction=refraction).locate(
        signals, Receiver(POSE, array, sonar), Survey(BOTTOM_DEPTH, PROFILE), rows
    )


def _honest(estimates: SourceEstimates, places: Sequence[Floats]) -> CaseResult:
    """Each row that says something is right within four errors about one of the places; others have a reason."""
    good, located = True, np.flatnonzero(np.isfinite(estimates.time))
    for row in located:
        azimuth, elevation = azimuth_elevation(np.array(places))
        off = np.hypot(
            (estimates.azimuth[row] - azimuth) / estimates.azimuth_error[row],
            (estimates.elevation[row] - elevation) / estimates.elevation_error[row],
        )
        good &= bool(off.min() < 4 * np.sqrt(2))
        if np.isfinite(estimates.position[row]).all():
            error = estimates.position[row] - places[int(off.argmin())]
            good &= bool(error @ np.linalg.solve(estimates.position_covariance[row], error) < 22.1)
    good &= bool((estimates.reason[np.isnan(estimates.time)] > 0).all())
    count = int(np.isfinite(estimates.position).all(axis=1).sum())
    reasons = sorted({REASONS[n] for n in estimates.reason if n})
    return holds(
        good, f"{len(located)} of {len(places)} heard, {count} placed" + (f" ({', '.join(reasons)})" * any(reasons))
    )


def _middle() -> CaseResult:
    """Half way between surface and bottom, 10 m to 5 km away, by straight and by bent rays; quiet, and with noise."""
    array, results = elements(LATTICE), []
    for distance in (10.0, 30.0, 100.0, 300.0, 1e3, 5e3):
        position = distance * direction(0.3, -0.2)
        for noise in (0.0, 1e-2 / distance):
            signals = _noisy_signals(array, [position], [1.0], noise, 1)
            for refraction in (False, True):
                estimates = _located(signals, array, 1, refraction=refraction)
                near = holds(bool(np.isfinite(estimates.time[0])), f"heard at {distance:g} m")
                results.append(near if not near.ok else _honest(estimates, [position]))
    return together(results)


def _bands() -> CaseResult:
    """100 Hz to 60 kHz about 40 kHz, or above 25 kHz: a place within its errors, or none with a reason."""
    array, position, results = elements(LATTICE), 20.0 * direction(0.3, -0.2), []
    signals = _noisy_signals(array, [position], [1.0], 1e-5, 2)
    for width in (100.0, 300.0, 1e3, 3e3, 10e3, 30e3, 60e3):
        low = TONE - 0.5 * width if width <= 30e3 else 25e3
        estimates = _located(signals, array, 1, Band(low=low, high=low + width))
        results.append(_honest(estimates, [position]))
        results.append(holds(not estimates.time_error[0] > 1 / width, "time within the pulse"))
    return together(results)


def _crowd() -> CaseResult:
    """1, 2, 5, 10 and 20 snaps at one instant: none that is accepted is anything but one of them."""
    array, results = elements(LATTICE), []
    for count in (1, 2, 5, 10, 20):
        random = np.random.default_rng(count)
        angles = random.uniform([-0.6, -0.5], [0.6, 0.3], (count, 2))
        places = [r * direction(*bearing) for r, bearing in zip(np.linspace(8.0, 40.0, count), angles, strict=True)]
        estimates = _located(_noisy_signals(array, places, [1.0] * count, 1e-5, count), array, count)
        results.append(_honest(estimates, places))
    return together(results)


def _stranger() -> CaseResult:
    """20 dB louder than the other, before it and after it: the clock is the louder one's."""
    array, results = elements(LATTICE), []
    for far in (14.0, 30.0):
        places = [20.0 * direction(-0.3, -0.2), far * direction(0.4, -0.1)]
        estimates = _located(_noisy_signals(array, places, [1.0, 10.0], 1e-5, 3), array, 2)
        off = float(np.abs(estimates.azimuth[0] - azimuth_elevation(places[1])[0]))
        results += [holds(off < 4 * estimates.azimuth_error[0], "the louder one first"), _honest(estimates, places)]
    return together(results)


CHORUS = """\
scene:
  world:
    environment: {{depth: 40 m, sound_speed: {{kind: isovelocity, speed: 1540 m/s}}}}
    sources: [{{kind: snapping_shrimp, position: [6, 5], source_level: 0 dB}}]
    chorus: {{density: {density}, deviation: 2 dB, reach: 400 m, images: 1}}
  sonar:
    array: {{kind: position_table, face: 0 m, positions: [[0, 0, 0], [0, 30, 0], [0, -30, 0], [30, 0, 0]]}}
    beams: {{azimuths: 3, elevations: 3}}
  trajectory: {{sonar: {{kind: still, position: [0, 0, {height}], heading: 90 deg}}}}
"""


def _chorus(density: float, height: float) -> tuple[Plan, xr.DataTree]:
    resolved = plan(reading.loads(CHORUS.format(density=density, height=height)), ("signals",))
    return resolved, render(resolved, 0)


def _dense() -> CaseResult:
    """Of 1e5 snaps a second within 400 m, in water of 40 m: the mean square is Campbell's, within and beyond."""
    resolved, tree = _chorus(0.2, -5.0)
    near, distant = resolved.chorus, resolved.distant_chorus
    snaps = int(tree["truth/soundscape"].dataset["snaps"])
    square = float(np.mean(tree["signals"].dataset["pressure"].values ** 2))
    if near is None or distant is None:
        return holds(False, "a chorus")
    total = near.level - 10.0 * np.log10(1.0 - distant.share)
    return together(
        holds(snaps > 300, f"{snaps} snaps in the record"),
        off(10.0 * np.log10(square) + 120.0 - total, 1.0, "dB", "level"),
    )


def _bounded() -> CaseResult:
    """Hydrophones at the surface, on the bottom, and where nothing snaps."""
    results = []
    for density, height in ((1e-2, 0.0), (1e-2, -40.0), (0.0, -5.0)):
        _, tree = _chorus(density, height)
        level = tree["truth/soundscape"].dataset["level"].values
        loudest = float(np.nanmax(level)) if density else -np.inf
        results.append(
            holds(bool(np.isfinite(tree["signals"].dataset["pressure"].values).all()), f"pressure at {-height:g} m")
        )
        results.append(holds(loudest < 185.0 + 5 * 2.0 + 49.2, f"no snap louder than at its bubble, {loudest:.4g} dB"))
    return together(results)


PING = """\
scene:
  world:
    environment: {{depth: 1000 m, sound_speed: {{kind: isovelocity, speed: 1540 m/s}}}}
    targets:
      - name: ball
        shape: {{kind: sphere, radius: 0.3 m, edge: 5 cm}}
        motion: {{kind: still, position: [{away}, 0, -50]}}
    sources:
      - kind: transmitter
        position: [5 cm, 0 cm, -25 cm]
        pulse: {{kind: sweep, start: 40 kHz, stop: 80 kHz, duration: {length} ms}}
        source_level: 190 dB
        beam: {{azimuth_width: 90 deg, elevation_width: 90 deg}}
  sonar:
    array: {{kind: planar_lattice, columns: 8, rows: 8, pitch: 5 cm}}
    band: {{low: 38 kHz, high: 82 kHz}}
    beams: {{azimuths: 21, elevations: 21}}
    sound_speed_error: 0 m/s
  trajectory: {{sonar: {{kind: still, position: [0, 0, -50], heading: 90 deg}}}}
  processing: {{locating: {{kind: trigger, time_error: 1 ns, position_error: 1 um}}}}
"""


def _pings() -> CaseResult:
    """Of 0.2, 2 and 20 ms, a target 2 and 20 m off: one point on it where the ping is over when its echo comes, or is
    as short as the way there and taken out; none where it goes on."""
    results = []
    for away, length, points in ((2, 0.2, 1), (2, 2, 1), (2, 20, 0), (20, 0.2, 1), (20, 2, 1), (20, 20, 1)):
        cloud = render(plan(reading.loads(PING.format(away=away, length=length)), ("cloud",)), 0)["cloud"].dataset
        count = int(cloud["count"])
        wrong = (cloud["range"] - cloud["true_range"]).values[:count] / cloud["range_error"].values[:count]
        good = count == points and bool((np.abs(wrong) < 3.0).all())
        results.append(holds(good, f"{count} points of a ping of {length:g} ms, {away} m off"))
    return together(results)


def _mirrored() -> CaseResult:
    """A snap on a rigid bottom, 12 m under the surface, and one at the surface, by 1 to 8 reflections."""
    depth, down, away, results = 12.0, 5.0, 9.0, []
    environment = replace(WATER, depth=depth, bottom=SeaBottom(reflection=Rigid()))
    receiver = Receiver(Pose(np.array([0.0, 0.0, -down]), POSE.orientation), POINT, SONAR)
    for most in range(1, 9):
        at_bottom, at_surface = (
            trace(
                FrameContext(0.0, (), (Emission(np.array([away, 0.0, z]), 0.0, PULSE, None),),
                             Medium(environment, PROFILE), receiver, ()),
                AutoTracing(bounces=most),
            )
            for z in (-depth, 0.0)
        )  # fmt: skip
        k = np.arange(most + 1)  # reflections on the way of the snap, one less than on that of its image
        height = np.where(k % 2 == 0, (k + 1) * depth - down, k * depth + down)
        pressure = 2.0 * (-1.0) ** ((k + 1) // 2) / np.hypot(away, height)
        found = at_bottom.amplitude[np.argsort(at_bottom.delay)]
        results += [relative(found, pressure, 1e-12), holds(not len(at_surface.delay), "nothing at the surface")]
    return together(results)


CASES = (
    Case("a snap in mid-water, 10 m to 5 km away", "the bearing; the place within its errors, or none", _middle),
    Case("bands of 100 Hz to 60 kHz", "the place within its errors, or none with a reason", _bands),
    Case("1 to 20 snaps at one instant", "each estimate one of them, or none with a reason", _crowd),
    Case("a stranger 20 dB louder", "the louder one first, each within its errors", _stranger),
    Case("1e5 snaps of a chorus a second", "the mean square of Campbell's theorem", _dense),
    Case("pings of 0.2 to 20 ms, targets 2 and 20 m off", "a point within its errors; none under the ping", _pings),
    Case("a snap on a rigid bottom, at a free surface", "it and its image, by every reflection; nothing", _mirrored),
    Case("a chorus at the surface and on the bottom", "finite, no louder than at the bubble", _bounded),
)
