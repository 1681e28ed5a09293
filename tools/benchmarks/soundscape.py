"""`tools/bench soundscape`: what each part of the sound costs a frame of remus.yaml beside its error, and how that
grows with snaps, hydrophones and samples. One core; median CPU time of new frames; a table.

Times are of this machine; `machine` is how much slower it is now than that of the costs in `planning.costs`, and
`gemm` the time of a product of float32 matrices of 1024. Errors: of the chorus the largest error over the peak against
a sum in float64, of correlated noise that of its coherence. Exponents are slopes of log time over log size, least
squares.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from benchmarks.timing import RECIPE, gemm, once
from sonarsynth.equations.arrays.apertures import element_directivity
from sonarsynth.equations.bubble import pulses
from sonarsynth.equations.noise.filters import response
from sonarsynth.pipeline.frame_chorus import frame_chorus, with_chorus
from sonarsynth.planning import Plan, plan
from sonarsynth.planning.costs import machine_factor
from sonarsynth.products import Signals
from sonarsynth.recipe import reading
from sonarsynth.signals import add_noise
from sonarsynth.signals.chorus.chorus_synthesis import chorus_pressure
from sonarsynth.signals.filtered_pulse import fir
from sonarsynth.signals.noise.drawing import coherence_error

FRAMES = 5
SNAPS = (1e3, 1e4, 1e5)
"""Snaps/s on the bottom within the reach."""
COLUMNS = (8, 12, 16, 24)
STRETCHES = (1, 2, 4, 8)
NOISES = {
    "independent": "{kind: flat, level: 40 dB}",
    "isotropic": "{kind: flat, level: 40 dB, directions: {kind: isotropic}}",
    "surface": "{kind: wind, wind_speed: 8 m/s, directions: {kind: surface}}",
    "bottom": "{kind: flat, level: 40 dB, directions: {kind: bottom}}",
}


def bench() -> dict[str, Any]:
    """Measure each part."""
    found: dict[str, Any] = {"machine": machine_factor(), "gemm_ms": gemm()}
    found["noise"] = {name: _noise(_planned(f"scene.world.environment.noise={text}")) for name, text in NOISES.items()}
    default = _planned("scene.world.chorus={}")
    found["chorus, default"] = _chorus(default) | {"snaps_per_second": _often(default)}
    found["distant chorus"] = _distant(_planned("scene.world.chorus={reach: 1 km}"))
    at = {snaps: _chorus(_at(snaps)) for snaps in SNAPS}
    found["chorus"] = {f"{snaps:g} snaps/s": row for snaps, row in at.items()}
    found["exponents"] = {
        "chorus, snaps": slope([(row["paths"], row["ms"]) for row in at.values()]),
        "chorus, hydrophones": slope([(n * n, _chorus(_at(1e5, _lattice(n)))["ms"]) for n in COLUMNS]),
        "chorus, samples": slope([(n, _chorus(_at(1e4), n)["ms"]) for n in STRETCHES]),
        "isotropic noise, hydrophones": slope([(n * n, _noise(_isotropic(_lattice(n)))["ms"]) for n in COLUMNS]),
        "isotropic noise, bins": slope([(n, _noise(_isotropic(), n)["ms"]) for n in STRETCHES]),
        "independent noise, bins": slope([
            (n, _noise(_planned(f"scene.world.environment.noise={NOISES['independent']}"), n)["ms"]) for n in STRETCHES
        ]),
    }  # fmt: skip
    return found


def table(found: dict[str, Any]) -> str:
    """Rows of part, ms and error."""
    lines = [
        f"this machine: {found['machine']:.2f} times the reference, {found['gemm_ms']:.1f} ms for a product of matrices"
    ]
    rows = {f"noise {name}": row for name, row in found["noise"].items()}
    rows |= {name: found[name] for name in ("chorus, default", "distant chorus")}
    rows |= {f"chorus, {name}": row for name, row in found["chorus"].items()}
    for name, row in rows.items():
        paths = f", {row['paths']:.0f} paths" if "paths" in row else ""
        lines.append(f"{name:28} {row['ms']:8.1f} ms {row['ms'] / found['machine']:8.1f} at the reference  "
                     f"error {row['error']:.2g}{paths}")  # fmt: skip
    return "\n".join([*lines, *(f"exponent of {name}: {value:.2f}" for name, value in found["exponents"].items())])


def slope(points: Sequence[tuple[float, float]]) -> float:
    """Exponent of a power law through (size, ms)."""
    size, ms = np.log(np.array(points)).T
    return float(np.polyfit(size, ms, 1)[0])


def _planned(*settings: str) -> Plan:
    return plan(reading.load(RECIPE, ["scene.world.environment.noise=null", *settings]), ("signals",))


def _lattice(columns: int) -> str:
    return f"scene.sonar.array={{kind: planar_lattice, columns: {columns}, rows: {columns}, pitch: 5 cm, face: 5 cm}}"


def _at(snaps: float, *settings: str) -> Plan:
    """400 m around, six images."""
    chorus = f"{{density: {snaps / (np.pi * 400.0**2):.6g}, reach: 400 m, images: 6, distant: false}}"
    return _planned(f"scene.world.chorus={chorus}", *settings)


def _isotropic(*settings: str) -> Plan:
    return _planned(f"scene.world.environment.noise={NOISES['isotropic']}", *settings)


def _often(made: Plan) -> float:
    chorus, reach = made.scene.world.chorus, made.chorus
    assert chorus is not None and reach is not None
    return float(chorus.rate * np.pi * reach.reach**2)


def _timed(frames: Sequence[int], one: Callable[[int], object]) -> float:
    """Median CPU ms of calls after the first, which compiles and fills tables."""
    return 1e3 * float(np.median([once(partial(one, frame))[1] for frame in frames][1:]))


def _silence(made: Plan, times: int = 1) -> Signals:
    samples, start = times * made.windows.samples, float(made.windows.start[0])
    pressure = np.zeros((made.elements.count, samples), np.float32)
    return Signals(pressure, start, made.scene.sonar.sampling_frequency, 0.0, 0, 0)


def _noise(made: Plan, times: int = 1) -> dict[str, float]:
    (noise,), sonar = made.scene.world.environment.noises, made.scene.sonar
    pose, silence = made.recipe.frame(0)[1].sonar_pose, _silence(made, times)
    random = np.random.default_rng(1)
    ms = _timed(range(FRAMES + 1), lambda _: add_noise(silence, noise, sonar, made.elements, random, pose, 1540.0))
    if noise.directions is None:
        return {"ms": ms, "error": 0.0}
    return {"ms": ms, "error": coherence_error(noise.directions, made.elements, pose, sonar, 1540.0)[0]}


def _distant(made: Plan) -> dict[str, float]:
    noise, sonar, silence = made.distant_chorus, made.scene.sonar, _silence(made)
    assert noise is not None
    pose, random = made.recipe.frame(0)[1].sonar_pose, np.random.default_rng(1)
    ms = _timed(range(FRAMES + 1), lambda _: add_noise(silence, noise, sonar, made.elements, random, pose, 1540.0))
    return {"ms": ms, "error": coherence_error(noise.directions, made.elements, pose, sonar, 1540.0)[0]}


def _chorus(made: Plan, times: int = 1) -> dict[str, float]:
    """Drawing, arrivals and pressure, without what is beyond the reach."""
    longer = replace(made, windows=replace(made.windows, samples=times * made.windows.samples))
    silence, paths = _silence(longer), []
    distant = made.distant_chorus is not None

    def one(index: int) -> None:
        frame = longer.recipe.frame(index)[1]
        arrivals = frame_chorus(longer, frame)
        assert arrivals is not None
        paths.append(len(arrivals.delay))
        with_chorus(longer, frame, silence, arrivals)

    ms = _timed(range(FRAMES + 1), one) - (_distant(longer)["ms"] if distant else 0.0)
    return {"ms": ms, "paths": float(np.median(paths)), "error": _error(made) if times == 1 else float("nan")}


def _error(made: Plan, most: int = 60) -> float:
    """Largest error over the peak of some paths at three hydrophones, against spectra summed in float64."""
    frame, sonar, chorus = made.recipe.frame(0)[1], made.scene.sonar, made.scene.world.chorus
    arrivals = frame_chorus(made, frame)
    assert arrivals is not None and chorus is not None
    inside = (arrivals.delay > made.windows.start[0] + 1e-3) & (arrivals.delay < made.windows.start[0] + 1.2e-2)
    some = arrivals.select(np.flatnonzero(inside)[:most])
    if not len(some.delay):
        return float("nan")
    samples, start, rate = made.windows.samples, float(made.windows.start[0]), sonar.sampling_frequency
    model = chorus.snap.at_depth(made.medium.depth)
    got = chorus_pressure(some, model, chorus.widths, made.elements, sonar, made.absorption, start, samples)
    length = 4 * samples
    f = np.arange(1, length // 2 + 1) * (rate / length)
    passed, lost = response(f, fir(sonar.antialias)), made.absorption(f)
    pulse = model.pulse(0.0, 0.6 * rate)
    which = [0, made.elements.count // 2, made.elements.count - 1]
    exact = np.zeros((len(which), length // 2 + 1), complex)
    for n in range(len(some.delay)):
        width = float(chorus.widths[some.width[n]])
        sent = pulses.spectrum(f, pulses.scaled(pulse, 1.0, width)) / pulse.peak * passed
        sent = sent * 1e-6 * 10.0 ** (some.level[n] / 20.0) * some.gain[n] * np.exp(1j * some.phase[n])
        sent *= np.exp(-0.5 * (2.0 * np.pi * f * some.delay_std[n]) ** 2) * 10.0 ** (-lost * some.length[n] / 20.0)
        for row, sensor in enumerate(which):
            away = some.length[n] * some.direction[n] - made.elements.position[sensor]
            far = float(np.linalg.norm(away))
            late = some.delay[n] + (far - some.length[n]) / some.sound_speed - start
            face = element_directivity(f, away / far, made.elements.face, some.sound_speed)
            exact[row, 1:] += sent * face * some.length[n] / far * np.exp(-2j * np.pi * f * late)
    true = np.fft.irfft(exact, length, axis=1)[:, :samples] * rate
    middle = slice(200, samples - 200)
    return float(np.abs(got[which][:, middle] - true[:, middle]).max() / np.abs(true[:, middle]).max())
