"""Signal to noise: what each part of the sound of a frame brings in the beams of each target.

Beams are those of delay and sum in the window of the image, whatever the image was made by: there parts add up. Sound
is taken as channels without errors would have it, before the converter.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Bools, Floats, Ints, direction
from sonarsynth.equations.arrays.gates import GATE_TAPER
from sonarsynth.imaging import FocusedDelayAndSum
from sonarsynth.imaging.image_window import snapshots_of
from sonarsynth.labels.estimate_labels import heard_first
from sonarsynth.pipeline.labelled_estimates import heard_directly
from sonarsynth.pipeline.stage_times import mark_stage
from sonarsynth.pipeline.stored_values import Values, table
from sonarsynth.pipeline.synthesis import array_signals, known_elements, true_elements
from sonarsynth.planning import Plan
from sonarsynth.planning.noise_rows import SIGNAL_TO_NOISE
from sonarsynth.products import Arrivals, EnergyImage, Kind, Signals, Truth
from sonarsynth.recipe.scene import Frame

MOST: Final = 64
"""Beams of a target that are looked at, spread evenly over all of its beams."""
SILENCE: Final = 1e-32
"""Pa2 s, -200 dB: what stands for nothing at all, so that every ratio is a number."""
PATHS: Final = "paths"
"""The part of all paths of the snaps that light."""
Part = npt.NDArray[np.float32] | None  # (sensor, sample) Pa; None: silence


class SoundParts:
    """What each part of the sound of a frame adds, kept while it is made: told by `synthesise`."""

    def __init__(self, plan: Plan) -> None:
        self.names = plan.scene.sound_parts
        self.signals: Signals | None = None  # the last that was told: when samples are
        self.pressure: dict[str, Part] = {}

    def __call__(self, name: str, signals: Signals) -> None:
        """As `Hearing`. Where echoes are all there is, nothing is kept."""
        if not self.names:
            return
        if name in (PATHS, *self.names):
            before = None if self.signals is None else self.signals.pressure
            same = before is not None and before is signals.pressure
            self.pressure[name] = None if same else signals.pressure if before is None else signals.pressure - before
        self.signals = signals


def snr_values(
    plan: Plan, frame: Frame, arrivals: Arrivals, truth: Truth, parts: SoundParts, image: EnergyImage | None
) -> Values:
    """Energies of all parts in the beams of each target, and the echo over the sum of the others; nothing where the
    scene has nothing but echoes. `plan` is that of the frame's sequence. Missing where no beam points at a target, and
    where the window, or the array, has nothing."""
    if not parts.names or parts.signals is None:
        return {}
    targets = range(len(frame.moment.bodies))
    beams = [target_beams(truth, n) for n in targets]
    window = _window(plan, frame, arrivals, image)
    energy = {name: np.full(len(targets), np.nan) for name in ("echo", *parts.names)}
    elements = known_elements(plan, frame)
    signals = parts.signals
    stop = signals.start + signals.pressure.shape[1] / signals.sampling_frequency
    if any(map(len, beams)) and signals.start <= window[0] < window[1] <= stop and elements.gain.any():
        look = _Look(plan, frame, signals, window)
        heard = {name: look.of_record(parts.pressure[name]) for name in parts.names}
        near = look.near(plan, arrivals)
        scattered = look.alone(plan, frame, arrivals, near & (arrivals.kind == Kind.REVERBERATION))
        for n in targets:
            if not len(beams[n]):
                continue
            own = (arrivals.target == n) & (arrivals.kind != Kind.REVERBERATION)
            only = own.any() and not (near & ~own).any()
            echo = look.of_record(parts.pressure[PATHS]) if only else look.alone(plan, frame, arrivals, near & own)
            weight = max(int(np.count_nonzero(truth.beam_target == n)), 1) / len(beams[n])
            energy["echo"][n] = weight * look.energy(echo, beams[n])
            for name in parts.names:
                energy[name][n] = weight * look.energy(heard[name], beams[n])
            if scattered is not None:
                energy["reverberation"][n] += weight * look.energy(scattered, beams[n])
    audible = {name: np.maximum(value, SILENCE) for name, value in energy.items()}
    level = {f"{name}_energy": 10.0 * np.log10(value) + 120.0 for name, value in audible.items()}
    snr = 10.0 * np.log10(audible["echo"] / np.sum([audible[name] for name in parts.names], axis=0))
    mark_stage(SIGNAL_TO_NOISE)
    return table("/truth/targets", **level, snr=snr)


def target_beams(truth: Truth, target: int) -> Ints:
    """Beams (beam,) of the grid, flat, that point at a target, no more than `MOST`; of one that is seen between beams
    the nearest, of one that is not seen none."""
    beams = np.flatnonzero(truth.beam_target.ravel() == target)
    if len(beams) > MOST:
        return np.asarray(beams[np.linspace(0, len(beams) - 1, MOST).round().astype(int)])
    box = truth.pixel_box[target]
    if len(beams) or not np.isfinite(box).all():
        return np.asarray(beams)
    rows, columns = truth.beam_target.shape
    row, column = (int(0.5 * (box[n] + box[n + 2])) for n in (1, 0))
    return np.array([min(row, rows - 1) * columns + min(column, columns - 1)])


def _window(plan: Plan, frame: Frame, arrivals: Arrivals, image: EnergyImage | None) -> tuple[float, float]:
    """The window (s) of the image; without one, that after the direct pulse of the first snap that lights."""
    if image is not None:
        return image.start, image.stop
    snaps = frame.moment.snaps
    first = heard_first(heard_directly(plan, arrivals, snaps), len(snaps))[0]
    light = next((float(t) for t, snap in zip(first, snaps, strict=True) if snap.illuminates), float("nan"))
    return light + plan.windows.echo_start, light + plan.windows.echo_stop


@dataclass(frozen=True, eq=False)
class _Heard:
    """A part of the sound in a window: what steers beams at it, and the unit of their powers."""

    unit: float
    steered: Callable[[Floats], npt.NDArray[np.complex64]]


class _Look:
    """Into a window of the record of a frame, by delay and sum."""

    def __init__(self, plan: Plan, frame: Frame, signals: Signals, window: tuple[float, float]) -> None:
        self.sonar, self.signals, self.window = plan.scene.sonar, signals, window
        self.elements, self.sensors = known_elements(plan, frame), true_elements(plan, frame)
        method = plan.choices.beamforming
        self.method = FocusedDelayAndSum(focus=method.focus, shading=getattr(method, "shading", "uniform"))
        beams = self.sonar.beams
        self.grid = direction(beams.azimuth, beams.elevation[:, None]).reshape(-1, 3)

    def near(self, plan: Plan, arrivals: Arrivals) -> Bools:
        """(path,) whether any of it may be in the window, at any sensor."""
        early, late = self._ends(plan, arrivals)
        return np.asarray((late > self.window[0]) & (early < self.window[1]))

    def _ends(self, plan: Plan, arrivals: Arrivals) -> tuple[Floats, Floats]:
        """From when to when (path,) s paths are heard, at any sensor."""
        spare, supports = self.sensors.aperture / arrivals.sound_speed, plan.windows.supports
        return arrivals.delay - supports.before - spare, arrivals.delay + supports.after + spare

    def of_record(self, pressure: Part) -> _Heard | None:
        """Sound (sensor, sample) of the frame's record, in the window."""
        return None if pressure is None else self._heard(replace(self.signals, pressure=pressure), self.window)

    def alone(self, plan: Plan, frame: Frame, arrivals: Arrivals, mask: Bools) -> _Heard | None:
        """Some paths (path,) alone, as long as they last in the window; for a pulse at least, so that the band is
        resolved."""
        if not mask.any():
            return None
        some, rate = arrivals.select(mask), self.signals.sampling_frequency
        (early, late), (first, last) = self._ends(plan, some), self.window
        pulse = plan.windows.supports.before + plan.windows.supports.after
        start = max(min(float(early.min()), last - pulse) - GATE_TAPER, first)
        stop = min(max(float(late.max()), first + pulse) + GATE_TAPER, last)
        samples = int((stop - start) * rate)
        return self._heard(
            array_signals(plan, frame, some, self.sensors, (start, samples)), (start, start + samples / rate)
        )

    def _heard(self, signals: Signals, window: tuple[float, float]) -> _Heard:
        prepared = snapshots_of(signals, self.sonar, *window, lasting=window[1] - window[0])
        return _Heard(prepared.unit, self.method.steered(prepared, self.elements, self.sonar))

    def energy(self, heard: _Heard | None, beams: Ints) -> float:
        """Energy in Pa2 s of sound in beams (beam,), added up."""
        if heard is None:
            return 0.0
        return float(heard.unit * np.sum(np.abs(heard.steered(self.grid[beams])).astype(float) ** 2))
