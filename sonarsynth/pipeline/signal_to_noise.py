"""Signal to noise: what each part of the sound of a frame brings in the beams of each target.

Beams are those of delay and sum in the window of the image, whatever the image was made by: there parts add up. Sound
is taken as channels without errors would have it, before the converter.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Bools, Ints, direction
from sonarsynth.imaging import FocusedDelayAndSum
from sonarsynth.imaging.image_window import snapshots_of
from sonarsynth.labels.estimate_labels import heard_first
from sonarsynth.pipeline.labelled_estimates import heard_directly
from sonarsynth.pipeline.stage_times import mark_stage
from sonarsynth.pipeline.stored_values import Values, table
from sonarsynth.pipeline.synthesis import array_signals, known_elements, true_elements
from sonarsynth.planning import Plan
from sonarsynth.planning.noise_rows import SIGNAL_TO_NOISE
from sonarsynth.products import Arrivals, EnergyImage, Kind, Signals, Snapshots, Truth
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
        near = look.near(plan, arrivals)
        scattered = look.alone(plan, frame, arrivals, near & (arrivals.kind == Kind.REVERBERATION))
        for n in targets:
            if not len(beams[n]):
                continue
            own = (arrivals.target == n) & (arrivals.kind != Kind.REVERBERATION)
            only = own.any() and not (near & ~own).any()
            echo = parts.pressure[PATHS] if only else look.alone(plan, frame, arrivals, near & own)
            weight = max(int(np.count_nonzero(truth.beam_target == n)), 1) / len(beams[n])
            energy["echo"][n] = weight * look.energy(echo, beams[n])
            for name in parts.names:
                energy[name][n] = weight * look.energy(parts.pressure[name], beams[n])
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


class _Look:
    """Into a window of the record of a frame, by delay and sum."""

    def __init__(self, plan: Plan, frame: Frame, signals: Signals, window: tuple[float, float]) -> None:
        self.sonar, self.signals, self.window = plan.scene.sonar, signals, window
        self.elements, self.sensors = known_elements(plan, frame), true_elements(plan, frame)
        method = plan.choices.beamforming
        self.method = FocusedDelayAndSum(focus=method.focus, shading=getattr(method, "shading", "uniform"))
        beams = self.sonar.beams
        self.grid = direction(beams.azimuth, beams.elevation[:, None]).reshape(-1, 3)
        self._made: dict[int, tuple[Part, Snapshots]] = {}

    def near(self, plan: Plan, arrivals: Arrivals) -> Bools:
        """(path,) whether any of it may be in the window, at any sensor."""
        spare, supports = self.sensors.aperture / arrivals.sound_speed, plan.windows.supports
        ends = arrivals.delay - supports.before - spare, arrivals.delay + supports.after + spare
        return np.asarray((ends[1] > self.window[0]) & (ends[0] < self.window[1]))

    def alone(self, plan: Plan, frame: Frame, arrivals: Arrivals, mask: Bools) -> Part:
        """Pressure of some paths (path,) alone."""
        return array_signals(plan, frame, arrivals.select(mask), self.sensors).pressure if mask.any() else None

    def energy(self, pressure: Part, beams: Ints) -> float:
        """Energy in Pa2 s of pressure in beams (beam,), added up."""
        if pressure is None:
            return 0.0
        if id(pressure) not in self._made:
            heard = replace(self.signals, pressure=pressure)
            prepared = snapshots_of(heard, self.sonar, *self.window, lasting=self.window[1] - self.window[0])
            self._made[id(pressure)] = pressure, prepared  # kept, so that no other has its id
        _, snapshots = self._made[id(pressure)]
        steered = self.method.steer(snapshots, self.elements, self.sonar, self.grid[beams])
        return float(snapshots.unit * np.sum(np.abs(steered).astype(float) ** 2))
