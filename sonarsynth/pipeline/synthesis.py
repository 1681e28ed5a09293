"""Pressure at the hydrophones of a frame, and what the sonar records of it: with noise, errors of sensors and channels,
and the converter. The array is one, or cut into subarrays to each of which paths are traced."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import NO_TARGET, Floats, Ints
from sonarsynth.description.method import returned
from sonarsynth.geometry.motion import pose, velocity
from sonarsynth.pipeline.handed_on import Sound
from sonarsynth.pipeline.stage_times import mark_stage
from sonarsynth.planning import Plan, arrivals_of, behind_baffle, context_of, frame_start, receiver_of
from sonarsynth.planning.measured.sampled_arrivals import reception_of
from sonarsynth.planning.noise_rows import ELECTRONICS, SENSORS, part_names
from sonarsynth.products import Arrivals, Kind, LateSignals, Signals
from sonarsynth.randomness import stream
from sonarsynth.receiver import Elements
from sonarsynth.receiver.sensor_errors import DrawnErrors, SensorState, drawn_errors
from sonarsynth.receiver.subarrays import subarrays
from sonarsynth.recipe.scene import Frame
from sonarsynth.signals import add_noise, channel_errors, convert
from sonarsynth.signals.electronics import ElectronicNoise
from sonarsynth.signals.noise.point_sources import add_noise_source
from sonarsynth.sources.noise_source import NoiseSource
from sonarsynth.sources.snap_models import Ricker
from sonarsynth.sources.sound_source import Emission
from sonarsynth.state import Receiver
from sonarsynth.tracing.arrivals import trace

SCATTERERS: Final = -2
"""Stands for the scatterers of reverberation, where targets have numbers."""
Pressure = npt.NDArray[np.float32]
"""(sensor, sample) Pa."""


class Recorder:
    """Called with the sound of a frame after each part is added to it. This one keeps nothing."""

    def __call__(self, part: str, signals: Signals) -> None:
        """signals: all parts so far, of which the one with this name was added last."""

    def echo(self, target: int, signals: Signals) -> None:
        """signals: the echoes of one target, of `SCATTERERS`, or of all else (`NO_TARGET`), from where they begin in
        the record to where they end. In a scene that has nothing but echoes, `NO_TARGET` is all of them."""


NO_RECORDER: Final = Recorder()


def prepared_sound(plan: Plan, frame: Frame, arrivals: Arrivals) -> Sound:
    """What `frame_signals` then sums at the hydrophones; none where the plan cuts the array into subarrays.

    What is made before the sums is small: made for some frames, one after the other, it stays in the caches of a core.
    """
    sound = {} if plan.choices.subarrays > 1 else _by_target(plan, frame, arrivals, true_elements(plan, frame))
    mark_stage("synthesise")
    return sound


def frame_signals(
    plan: Plan, frame: Frame, arrivals: Arrivals, recorder: Recorder = NO_RECORDER, sound: Sound | None = None
) -> Signals:
    """Pressure at each hydrophone, at its true place, before noise and converter.

    arrivals: paths of the frame to the whole array; sound: what `prepared_sound` has of these, if at hand. Where the
    plan cuts the array into subarrays, paths are traced again to each, and `outside` is that of the subarray that loses
    most. In a scene that has more than echoes, the echoes of each target are made apart, which its signal to noise
    needs, and added. Raises ValueError for anything outside the water.
    """
    sensors, start, rate = true_elements(plan, frame), frame_start(plan, frame), plan.scene.sonar.sampling_frequency
    if plan.choices.subarrays == 1:
        heard, outside = _summed(sound or _by_target(plan, frame, arrivals, sensors))
    else:
        heard, outside = dict[int, Signals](), 0
        for part in subarrays(sensors, plan.choices.subarrays):
            of_part, lost = _summed(_by_target(plan, frame, arrivals_of(plan, frame, part), part.elements))
            for target, signals in of_part.items():
                if target not in heard:
                    heard[target] = Signals(_silence(plan, sensors), start, rate, 0.0, 0, 0)
                _add(heard[target], signals, part.sensor)
            outside = max(outside, lost)
        heard = {target: replace(signals, outside=outside) for target, signals in heard.items()}
    for target, signals in heard.items():
        recorder.echo(target, signals)
    if not plan.scene.sound_parts:
        return heard[NO_TARGET]
    total = Signals(_silence(plan, sensors), start, rate, 0.0, 0, outside)
    for signals in heard.values():
        _add(total, signals)
    return total


def _silence(plan: Plan, sensors: Elements) -> Pressure:
    return np.zeros((sensors.count, plan.windows.samples), np.float32)


def _add(total: Signals, signals: Signals, sensor: Ints | slice = slice(None)) -> None:
    """Add signals of some sensors, which may be of a part of the window alone, to the pressure of a total."""
    first = round((signals.start - total.start) * total.sampling_frequency)
    total.pressure[sensor, first : first + signals.pressure.shape[1]] += signals.pressure


def _by_target(plan: Plan, frame: Frame, arrivals: Arrivals, sensors: Elements) -> Sound:
    """The sound of each target, numbered as in `Recorder.echo`: one number in a scene that has nothing but echoes, else
    each of the stretch of the window that it sounds in."""
    if not plan.scene.sound_parts:
        return {NO_TARGET: _prepared(plan, frame, arrivals, sensors)}
    owner = np.where(arrivals.kind == Kind.REVERBERATION, SCATTERERS, arrivals.target)
    return {
        number: _prepared(plan, frame, arrivals.select(np.flatnonzero(owner == number)), sensors, whole=False)
        for number in np.union1d(owner, NO_TARGET).tolist()
    }


def _summed(sound: Sound) -> tuple[dict[int, Signals], int]:
    """Signals by target, and how many arrivals the window cuts."""
    heard = {target: signals() for target, signals in sound.items()}
    return heard, sum(signals.outside for signals in heard.values())


def array_signals(plan: Plan, frame: Frame, arrivals: Arrivals, sensors: Elements) -> Signals:
    """Pressure at hydrophones, of arrivals that are expanded over all of them; the baffle weakens sound from behind."""
    return _prepared(plan, frame, arrivals, sensors)()


def _prepared(
    plan: Plan, frame: Frame, arrivals: Arrivals, sensors: Elements, *, whole: bool = True
) -> Callable[[], Signals]:
    """What gives `array_signals`, made as far as the method makes them before they are looked at. whole: as of
    `Reception`."""
    reception = reception_of(plan, frame)._replace(elements=sensors, whole=whole, still=not frame.sonar_velocity.any())
    method, heard = plan.choices.synthesis, behind_baffle(arrivals, plan.scene.sonar)
    late = method.signals(heard, frame.moment.snaps, reception)

    def signals() -> Signals:
        made = copy(late)  # what is summed is not kept
        refused = plan.scene.sonar.converter is not None  # NaN, without a look at all samples here
        samples = (reception.samples,) if whole else getattr(made, "shape", (0, 0))[1:]
        shape = sensors.count, *samples
        if refused and isinstance(made, LateSignals) and made.shape == shape:
            return made
        checked: Signals = returned(method, "signals", made, shape, "pressure", unknown=refused)
        return checked

    return signals


def errors_of(plan: Plan, frame: Frame) -> DrawnErrors | None:
    """What is wrong with the sensors in the sequence of a frame; None where nothing is described."""
    errors = plan.scene.sonar.sensor_errors
    return None if errors is None else drawn_errors(errors, plan.elements.count, frame.seed, frame.key)


def true_elements(plan: Plan, frame: Frame) -> Elements:
    """The elements with their position errors in y and z. An error along x counts as a delay of the channel."""
    drawn = errors_of(plan, frame)
    if drawn is None or not drawn.position.any():
        return plan.elements
    return _moved(plan.elements, drawn)


@lru_cache(maxsize=8)
def _moved(elements: Elements, drawn: DrawnErrors) -> Elements:
    return replace(elements, position=elements.position + drawn.position * [0.0, 1.0, 1.0])


def digitise(plan: Plan, frame: Frame, signals: Signals, recorder: Recorder = NO_RECORDER) -> Signals:
    """Signals as the sonar records them: with ambient noise, errors of the channels, electronics, converter.

    `plan` is that of the sequence. Each part draws from a random stream of its own.
    """
    mark_stage("synthesise")
    sonar, sensors = plan.scene.sonar, true_elements(plan, frame)
    receiver = receiver_of(plan, frame).at(signals.start + 0.5 * signals.pressure.shape[1] / signals.sampling_frequency)
    pose, sound_speed = receiver.pose, receiver.speed(plan.medium)
    noises = plan.scene.world.environment.noises
    for number, (name, noise) in enumerate(zip(part_names(noises), noises, strict=True)):
        if noise.played:
            signals = _with_played_noise(plan, frame, signals, noise, number, receiver)
        else:
            random = stream(frame.seed, "noise", frame.key, frame.step, *([number] if number else []))
            signals = add_noise(signals, noise, sonar, sensors, random, pose, sound_speed)
        mark_stage(name)
    for number, source in enumerate(plan.scene.world.noise_sources):
        signals = _with_noise_source(plan, frame, signals, source, number, receiver)
        mark_stage(f"noise of {source.name}")
    recorder("noise", signals)
    signals = _through_channels(plan, frame, signals, sound_speed, recorder)
    return convert(signals, sonar.converter)


def _with_played_noise(
    plan: Plan, frame: Frame, signals: Signals, noise: Any, number: int, receiver: Receiver
) -> Signals:
    """Signals with a recording. The direction of each stretch of it is drawn once a sequence."""
    from sonarsynth.signals.noise.played_noise import add_played_noise  # seldom needed

    def even(stretch: int) -> Floats:
        return stream(frame.seed, "played noise", frame.key, number, stretch).random(2)

    sensors, pose, speed = true_elements(plan, frame), receiver.pose, receiver.speed(plan.medium)
    return add_played_noise(signals, noise, receiver.sonar, sensors, pose, speed, time=frame.time, even=even)


def _with_noise_source(
    plan: Plan, frame: Frame, signals: Signals, source: NoiseSource, number: int, receiver: Receiver
) -> Signals:
    """Signals with the sound of one source: all of it takes the paths of the sound that the array hears where
    `receiver` has it, in the middle of the record."""
    own, then, late = receiver.pose.position, frame.time + receiver.instant, 0.0
    for _ in range(3):  # sources make way at a hundredth of the speed of sound, or less
        away = np.linalg.norm(pose(source.motion, then - late).position - own)
        late = float(away) / receiver.speed(plan.medium)
    position, sonar = pose(source.motion, then - late).position, receiver.sonar
    instant = Emission(position, receiver.instant - late, Ricker(frequency=sonar.band.centre), None, illuminates=False)
    arrivals = trace(replace(context_of(plan, frame), snaps=(instant,)), plan.propagation)
    arrivals = behind_baffle(replace(arrivals, delay=arrivals.delay - instant.time), sonar)
    apart = position - own
    slowness = apart / max(float(np.linalg.norm(apart)), 1e-9) / arrivals.sound_speed
    own_velocity = frame.sonar_velocity if receiver.track is None else receiver.track.velocity
    ours, theirs = own_velocity @ slowness, velocity(source.motion, then - late) @ slowness
    random = stream(frame.seed, "noise source", frame.key, frame.step, number)
    faster = float((1.0 + ours) / (1.0 + theirs))
    moving = partial(add_noise_source, time=then - late, faster=faster, random=random)
    return moving(signals, source, arrivals, instant, true_elements(plan, frame), sonar, plan.absorption)


def _through_channels(plan: Plan, frame: Frame, signals: Signals, sound_speed: float, recorder: Recorder) -> Signals:
    """Signals with the errors of the channels and the noise of the electronics."""
    sonar, drawn = plan.scene.sonar, errors_of(plan, frame)
    errors, louder = sonar.sensor_errors, np.ones(plan.elements.count)
    if errors is not None and drawn is not None:
        signals = channel_errors.respond(signals, drawn, sound_speed)
        if errors.cross_talk is not None:
            signals = channel_errors.talk(signals, plan.elements, errors.cross_talk)
        louder[drawn.state == SensorState.NOISY] = 10.0 ** (errors.noisy_by / 20.0)
        mark_stage(SENSORS)
    recorder("channels", signals)
    if sonar.electronics is not None:
        random = stream(frame.seed, "electronics", frame.key, frame.step)
        own = replace(plan.elements, gain=np.where(plan.elements.gain == 0.0, 0.0, louder))
        signals = add_noise(signals, ElectronicNoise(sonar.electronics), sonar, own, random)
        recorder("electronics", signals)
        mark_stage(ELECTRONICS)
    if errors is not None and drawn is not None:
        if errors.jitter or errors.clock_rate:
            random = stream(frame.seed, "jitter", frame.key, frame.step)
            signals = channel_errors.sampled(signals, errors.jitter, drawn.clock_rate, random)
        if errors.overload is not None:
            signals = channel_errors.overloaded(signals, errors.overload)
        if errors.stuck and sonar.converter is not None:
            stuck = (sonar.converter.full_scale * drawn.stuck_at)[:, None].astype(np.float32)
            is_stuck = ((drawn.state == SensorState.STUCK) & (plan.elements.gain > 0.0))[:, None]
            signals = replace(signals, pressure=np.where(is_stuck, stuck, signals.pressure))
        mark_stage(SENSORS)
    return signals


def known_elements(plan: Plan, frame: Frame) -> Elements:
    """The elements that processing uses: those that it knows to be dead or stuck have gain 0."""
    errors, drawn = plan.scene.sonar.sensor_errors, errors_of(plan, frame)
    if errors is None or drawn is None or errors.known == "none":
        return plan.elements
    return _working(plan.elements, drawn)


@lru_cache(maxsize=8)
def _working(elements: Elements, drawn: DrawnErrors) -> Elements:
    return elements if drawn.works.all() else replace(elements, gain=elements.gain * drawn.works)


def known_signals(plan: Plan, frame: Frame, signals: Signals) -> Signals:
    """Signals that processing uses: corrected for the channel errors that it knows."""
    errors, drawn = plan.scene.sonar.sensor_errors, errors_of(plan, frame)
    if errors is None or drawn is None:
        return signals
    return channel_errors.corrected(signals, errors, drawn, plan.scene.sonar.assumed_sound_speed)
