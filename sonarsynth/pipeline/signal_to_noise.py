"""Signal to noise: the energy of each part of the sound of a frame in the beams of each target.

Beams are those of delay and sum in the window of the image, whatever method made the image: in them parts add up. The
sound is that of channels without errors, before the converter.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from sonarsynth.conventions import Floats, Ints, direction
from sonarsynth.equations.arrays.gates import GATE_TAPER, gate_samples
from sonarsynth.imaging import FocusedDelayAndSum
from sonarsynth.imaging.image_window import snapshots_of, sounding
from sonarsynth.labels.estimate_labels import heard_first
from sonarsynth.pipeline.labelled_estimates import heard_directly
from sonarsynth.pipeline.stage_times import mark_stage
from sonarsynth.pipeline.stored_values import Values, table
from sonarsynth.pipeline.synthesis import SCATTERERS, Pressure, Recorder, known_elements
from sonarsynth.planning import Plan
from sonarsynth.planning.noise_rows import SIGNAL_TO_NOISE, SNR_BEAMS
from sonarsynth.products import Arrivals, EnergyImage, Signals, Truth
from sonarsynth.recipe.scene import Frame

FINE: Final = 256
"""Bins of the band at least, so that little lies between its edges and the next bins."""
FEW: Final = 16
"""Of so many hydrophones one is asked first whether sound lasts as long as the window."""
SILENCE: Final = 1e-32
"""Pa2 s, -200 dB: what stands for nothing at all, so that every ratio is a number."""
Part = Signals | None  # None: silence; else of the record, or of the stretch of it that there is sound in


class SoundParts(Recorder):
    """The pressure that each part of the sound adds, kept while a frame is made."""

    def __init__(self, plan: Plan) -> None:
        self.names = plan.scene.sound_parts
        self.signals: Signals | None = None  # the last that was told: when samples are
        self.sound: dict[str, Part] = {}
        self.echoes: dict[int, Part] = {}  # of targets, and of scatterers

    def __call__(self, part: str, signals: Signals) -> None:
        """As `Recorder`. In a scene that has nothing but echoes, nothing is kept."""
        if not self.names:
            return
        if part in self.names:
            self.sound[part] = _added(self.signals, signals)
        self.signals = signals

    def echo(self, target: int, signals: Signals) -> None:
        """As `Recorder.echo`."""
        self.echoes[target] = signals


def _added(before: Signals | None, after: Signals) -> Part:
    """What a part added."""
    if before is None:
        return after
    return None if before.pressure is after.pressure else replace(after, pressure=after.pressure - before.pressure)


def snr_values(
    plan: Plan, frame: Frame, arrivals: Arrivals, truth: Truth, parts: SoundParts, image: EnergyImage | None
) -> Values:
    """Energy (dB) of each part in the beams of each target, and the ratio of echo to the sum of all other parts.

    Empty in a scene that has nothing but echoes. NaN for a target that no beam points at, and for all targets where the
    window is not in the record or no element is live. `plan` is that of the frame's sequence.
    """
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
        beamformed = _BeamEnergies(plan, frame, signals, window)
        seen = [n for n in targets if len(beams[n])]
        first = np.cumsum([0, *(len(beams[n]) for n in seen[:-1])])
        weight = [max(int(np.count_nonzero(truth.beam_target == n)), 1) / len(beams[n]) for n in seen]
        every = np.concatenate([beams[n] for n in seen])

        def heard(part: Part) -> Floats:
            return np.asarray(weight * np.add.reduceat(beamformed.energies(part, every), first))

        for name in parts.names:
            energy[name][seen] = heard(parts.sound[name])
        if SCATTERERS in parts.echoes:
            energy["reverberation"][seen] += heard(parts.echoes[SCATTERERS])
        for n, share in zip(seen, weight, strict=True):
            energy["echo"][n] = share * beamformed.energies(parts.echoes.get(n), beams[n]).sum()
    audible = {name: np.maximum(value, SILENCE) for name, value in energy.items()}
    level = {f"{name}_energy": 10.0 * np.log10(value) + 120.0 for name, value in audible.items()}
    snr = 10.0 * np.log10(audible["echo"] / np.sum([audible[name] for name in parts.names], axis=0))
    mark_stage(SIGNAL_TO_NOISE)
    return table("/truth/targets", **level, snr=snr)


def target_beams(truth: Truth, target: int) -> Ints:
    """Indices (beam,) in the flat grid of at most `SNR_BEAMS` beams that point at a target: the nearest beam for a
    target between beams, none for one that is not seen."""
    beams = np.flatnonzero(truth.beam_target.ravel() == target)
    if len(beams) > SNR_BEAMS:
        return np.asarray(beams[np.linspace(0, len(beams) - 1, SNR_BEAMS).round().astype(int)])
    box = truth.pixel_box[target]
    if len(beams) or not np.isfinite(box).all():
        return np.asarray(beams)
    rows, columns = truth.beam_target.shape
    row, column = (int(0.5 * (box[n] + box[n + 2])) for n in (1, 0))
    return np.array([min(row, rows - 1) * columns + min(column, columns - 1)])


def _window(plan: Plan, frame: Frame, arrivals: Arrivals, image: EnergyImage | None) -> tuple[float, float]:
    """The window (start, stop) in s of the image; without an image, the echo window of the first snap that
    illuminates."""
    if image is not None:
        return image.start, image.stop
    snaps = frame.moment.snaps
    first = heard_first(heard_directly(plan, arrivals, snaps), len(snaps))[0]
    light = next((float(t) for t, snap in zip(first, snaps, strict=True) if snap.illuminates), float("nan"))
    return light + plan.windows.echo_start, light + plan.windows.echo_stop


class _BeamEnergies:
    """Energies of beams of delay and sum in a window of the record of a frame."""

    def __init__(self, plan: Plan, frame: Frame, signals: Signals, window: tuple[float, float]) -> None:
        self.sonar, self.signals, self.window = plan.scene.sonar, signals, window
        self.elements = known_elements(plan, frame)
        method = plan.choices.beamforming
        self.method = FocusedDelayAndSum(focus=method.focus, shading=getattr(method, "shading", "uniform"))
        beams = self.sonar.beams
        record, rate = signals.pressure.shape[1], signals.sampling_frequency
        self.first, self.count = gate_samples(*window, signals.start, rate, record)  # of the window in the record
        self.grid = direction(beams.azimuth, beams.elevation[:, None]).reshape(-1, 3)

    def energies(self, part: Part, beams: Ints) -> Floats:
        """Energy (beam,) in Pa2 s of a part of the sound in beams (beam,)."""
        if part is None:
            return np.zeros(len(beams))
        late = round((part.start - self.signals.start) * part.sampling_frequency) - self.first
        inside, late = part.pressure[:, max(-late, 0) : max(self.count - late, 0)], max(late, 0)
        if not inside.shape[1]:
            return np.zeros(len(beams))
        start, stop = self._gate(inside, late)
        heard = part if inside.shape[1] == self.count else self._amid_silence(part, inside, late, start, stop)
        snapshots = snapshots_of(heard, self.sonar, start, stop)
        return self.method.energies_in(snapshots, self.elements, self.sonar, self.grid[beams])

    def _amid_silence(self, part: Signals, inside: Pressure, late: int, start: float, stop: float) -> Signals:
        """A part of the sound from start to stop (s), with the silence before and after it; arrays as of `_gate`."""
        rate = part.sampling_frequency
        first, count = gate_samples(start, stop, self.signals.start, rate, self.signals.pressure.shape[1])
        pressure, before = np.zeros((len(inside), count), np.float32), late - (first - self.first)
        heard = inside[:, max(-before, 0) : max(count - before, 0)]
        pressure[:, max(before, 0) :][:, : heard.shape[1]] = heard
        return replace(part, pressure=pressure, start=self.signals.start + first / rate)

    def _gate(self, inside: Pressure, late: int) -> tuple[float, float]:
        """Start and stop (s) of the part of the window that holds the energy of pressure (sensor, sample), which begins
        at its sample `late`, widened by the largest steering delay. An echo is short: to transform the whole window
        takes three times as long."""
        (start, stop), rate, band = self.window, self.signals.sampling_frequency, self.sonar.band
        for step in (FEW, 1):  # what lasts as long as the window does so at any hydrophone
            power = np.einsum("ij,ij->j", inside[::step], inside[::step]).astype(float)
            begins, ends = ((late + n) / rate for n in sounding(power))
            apart = GATE_TAPER + self.elements.aperture / self.sonar.assumed_sound_speed
            apart = max(apart, 0.5 * (FINE / (band.high - band.low) - ends + begins))
            gate = max(start, start + begins - apart), min(stop, start + ends + apart)
            if gate == self.window:
                break
        return gate
