"""What the hydrophones hear of a frame, from one expansion of its paths over the array or from one for each part; and
what the sonar makes of that: noise, errors of sensors and channels, converter."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache, partial
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import NO_TARGET, Floats, depth
from sonarsynth.geometry.motion import pose, velocity
from sonarsynth.pipeline.stage_times import mark_stage
from sonarsynth.planning import Plan, arrivals_of, behind_baffle, context_of, frame_start
from sonarsynth.planning.measured.sampled_arrivals import reception_of
from sonarsynth.planning.noise_rows import ELECTRONICS, SENSORS, part_names
from sonarsynth.products import Arrivals, Kind, Signals
from sonarsynth.randomness import stream
from sonarsynth.receiver import Elements
from sonarsynth.receiver.sensor_errors import DrawnErrors, SensorState, drawn_errors
from sonarsynth.receiver.subarrays import Subarray, subarrays
from sonarsynth.recipe.scene import Frame
from sonarsynth.signals import add_noise, channel_errors, convert
from sonarsynth.signals.electronics import ElectronicNoise
from sonarsynth.signals.noise.point_sources import add_noise_source
from sonarsynth.sources.noise_source import NoiseSource
from sonarsynth.sources.snap_models import Ricker
from sonarsynth.sources.sound_source import Emission
from sonarsynth.tracing.arrivals import trace

SCATTERERS: Final = -2
"""Stands for the scatterers of reverberation, where targets have numbers."""
Pressure = npt.NDArray[np.float32]
"""(sensor, sample) Pa."""


class Hearing:
    """Is told what there is of the sound of a frame, part by part. This one keeps nothing."""

    def __call__(self, part: str, signals: Signals) -> None:
        """All that is heard once a part, by name, has come to it."""

    def echo(self, target: int, pressure: Pressure) -> None:
        """What a target, `SCATTERERS` or, as `NO_TARGET`, all else brings, where the scene has more than echoes."""


NOBODY: Final = Hearing()


def frame_signals(plan: Plan, frame: Frame, arrivals: Arrivals, hearing: Hearing = NOBODY) -> Signals:
    """Pressure at each hydrophone where it is, without noise and converter; arrivals: those of the frame at the whole
    array.

    Where the scene has more than echoes, what each target brings is made by itself, for its signal to noise, and added
    up. Where the array is cut into parts, paths are traced again to each of them. `outside` is that of the part that
    loses most. Raises ValueError for anything outside the water.
    """
    sensors = true_elements(plan, frame)
    if plan.choices.subarrays == 1:
        heard, outside = _by_target(plan, frame, arrivals, sensors)
    else:
        heard, outside = dict[int, Pressure](), 0
        for part in subarrays(sensors, plan.choices.subarrays):
            of_part, lost = subarray_signals(plan, frame, part)
            for target, pressure in of_part.items():
                silence = np.zeros((sensors.count, plan.windows.samples), np.float32)
                heard.setdefault(target, silence)[part.sensor] = pressure
            outside = max(outside, lost)
    for target, pressure in heard.items():
        hearing.echo(target, pressure)
    first, *others = heard.values()
    total = first.copy() if others else first
    for pressure in others:
        total += pressure
    return Signals(total, frame_start(plan, frame), plan.scene.sonar.sampling_frequency, 0.0, 0, outside)


def _by_target(plan: Plan, frame: Frame, arrivals: Arrivals, sensors: Elements) -> tuple[dict[int, Pressure], int]:
    """What hydrophones hear of arrivals, as `Hearing.echo` is told, all in one where there is nothing but echoes; and
    how many arrivals the window cuts."""
    if not plan.scene.sound_parts:
        signals = array_signals(plan, frame, arrivals, sensors)
        return {NO_TARGET: signals.pressure}, signals.outside
    owner = np.where(arrivals.kind == Kind.REVERBERATION, SCATTERERS, arrivals.target)
    heard = {
        number: array_signals(plan, frame, arrivals.select(np.flatnonzero(owner == number)), sensors)
        for number in np.union1d(owner, NO_TARGET).tolist()
    }
    return {n: signals.pressure for n, signals in heard.items()}, sum(signals.outside for signals in heard.values())


def subarray_signals(plan: Plan, frame: Frame, part: Subarray) -> tuple[dict[int, Pressure], int]:
    """As `_by_target`, what a part of the array hears, of paths that are traced to it."""
    return _by_target(plan, frame, arrivals_of(plan, frame, part), part.elements)


def array_signals(plan: Plan, frame: Frame, arrivals: Arrivals, sensors: Elements) -> Signals:
    """What hydrophones hear of arrivals, expanded over all of them; what comes from behind, through the baffle."""
    reception = reception_of(plan, frame)._replace(elements=sensors)
    return plan.choices.synthesis.signals(behind_baffle(arrivals, plan.scene.sonar), frame.moment.snaps, reception)


def errors_of(plan: Plan, frame: Frame) -> DrawnErrors | None:
    """What is wrong with the sensors in the sequence of a frame; None where nothing is described."""
    errors = plan.scene.sonar.sensor_errors
    return None if errors is None else drawn_errors(errors, plan.elements.count, frame.seed, frame.key)


def true_elements(plan: Plan, frame: Frame) -> Elements:
    """The elements where they are across the axis: along it, a wrong position is a delay of the channel."""
    drawn = errors_of(plan, frame)
    if drawn is None or not drawn.position.any():
        return plan.elements
    return _moved(plan.elements, drawn)


@lru_cache(maxsize=8)
def _moved(elements: Elements, drawn: DrawnErrors) -> Elements:
    return replace(elements, position=elements.position + drawn.position * [0.0, 1.0, 1.0])


def digitise(plan: Plan, frame: Frame, signals: Signals, hearing: Hearing = NOBODY) -> Signals:
    """Signals as the sonar has them: ambient noise, errors of the channels, electronics, converter; `plan` is that of
    the sequence. Each part has a stream of its own."""
    mark_stage("synthesise")
    sonar, pose = plan.scene.sonar, frame.sonar_pose
    sound_speed = float(plan.profile.at(depth(pose.position)))
    noises = plan.scene.world.environment.noises
    for number, (name, noise) in enumerate(zip(part_names(noises), noises, strict=True)):
        if noise.played:
            signals = _with_played_noise(plan, frame, signals, noise, number)
        else:
            random = stream(frame.seed, "noise", frame.key, frame.step, *([number] if number else []))
            signals = add_noise(signals, noise, sonar, plan.elements, random, pose, sound_speed)
        mark_stage(name)
    for number, source in enumerate(plan.scene.world.noise_sources):
        signals = _with_noise_source(plan, frame, signals, source, number)
        mark_stage(f"noise of {source.name}")
    hearing("noise", signals)
    signals = _through_channels(plan, frame, signals, sound_speed, hearing)
    return signals if sonar.converter is None else convert(signals, sonar.converter)


def _with_played_noise(plan: Plan, frame: Frame, signals: Signals, noise: Any, number: int) -> Signals:
    """Signals with a recording; where each stretch of it comes from is drawn once a sequence."""
    from sonarsynth.signals.noise.played_noise import add_played_noise  # seldom needed

    def even(stretch: int) -> Floats:
        return stream(frame.seed, "played noise", frame.key, number, stretch).random(2)

    pose = frame.sonar_pose
    sound_speed = float(plan.profile.at(depth(pose.position)))
    return add_played_noise(
        signals, noise, plan.scene.sonar, plan.elements, pose, sound_speed, time=frame.time, even=even
    )


def _with_noise_source(plan: Plan, frame: Frame, signals: Signals, source: NoiseSource, number: int) -> Signals:
    """Signals with the sound of one source, by the paths of an emission that is heard at the instant of the frame."""
    own = frame.sonar_pose.position
    away = np.linalg.norm(pose(source.motion, frame.time).position - own)
    late = float(away) / float(plan.profile.at(depth(own)))
    time, position = frame.time - late, pose(source.motion, frame.time - late).position
    pulse = Ricker(frequency=plan.scene.sonar.band.centre)
    instant = Emission(position, -late, pulse, None, illuminates=False)
    arrivals = trace(replace(context_of(plan, frame), snaps=(instant,)), plan.propagation)
    arrivals = replace(arrivals, delay=arrivals.delay + late)
    apart = position - frame.sonar_pose.position
    closing = (frame.sonar_velocity - velocity(source.motion, time)) @ apart / max(float(np.linalg.norm(apart)), 1e-9)
    random = stream(frame.seed, "noise source", frame.key, frame.step, number)
    sonar, sensors = plan.scene.sonar, true_elements(plan, frame)
    arrivals = behind_baffle(arrivals, sonar)
    moving = partial(add_noise_source, time=frame.time, closing=float(closing), random=random)
    return moving(signals, source, arrivals, instant, sensors, sonar, plan.absorption)


def _through_channels(plan: Plan, frame: Frame, signals: Signals, sound_speed: float, hearing: Hearing) -> Signals:
    """Signals after what is wrong with the channels, and with the noise of the electronics."""
    sonar, drawn = plan.scene.sonar, errors_of(plan, frame)
    errors, louder = sonar.sensor_errors, np.ones(plan.elements.count)
    if errors is not None and drawn is not None:
        signals = channel_errors.respond(signals, drawn, sound_speed)
        if errors.cross_talk is not None:
            signals = channel_errors.talk(signals, plan.elements, errors.cross_talk)
        louder[drawn.state == SensorState.NOISY] = 10.0 ** (errors.noisy_by / 20.0)
        mark_stage(SENSORS)
    hearing("channels", signals)
    if sonar.electronics is not None:
        random = stream(frame.seed, "electronics", frame.key, frame.step)
        own = replace(plan.elements, gain=np.where(plan.elements.gain == 0.0, 0.0, louder))
        signals = add_noise(signals, ElectronicNoise(sonar.electronics), sonar, own, random)
        hearing("electronics", signals)
        mark_stage(ELECTRONICS)
    if errors is not None and drawn is not None:
        if errors.jitter or errors.clock_rate:
            random = stream(frame.seed, "jitter", frame.key, frame.step)
            signals = channel_errors.sampled(signals, errors.jitter, drawn.clock_rate, random)
        if errors.overload is not None:
            signals = channel_errors.overloaded(signals, errors.overload)
        if errors.stuck and sonar.converter is not None:
            stuck = (sonar.converter.full_scale * drawn.stuck_at)[:, None].astype(np.float32)
            is_stuck = (drawn.state == SensorState.STUCK)[:, None]
            signals = replace(signals, pressure=np.where(is_stuck, stuck, signals.pressure))
        mark_stage(SENSORS)
    return signals


def known_elements(plan: Plan, frame: Frame) -> Elements:
    """The elements as processing has them: without those that it knows to be dead or stuck."""
    errors, drawn = plan.scene.sonar.sensor_errors, errors_of(plan, frame)
    if errors is None or drawn is None or errors.known == "none":
        return plan.elements
    return _working(plan.elements, drawn)


@lru_cache(maxsize=8)
def _working(elements: Elements, drawn: DrawnErrors) -> Elements:
    works = (drawn.state != SensorState.DEAD) & (drawn.state != SensorState.STUCK)
    return elements if works.all() else replace(elements, gain=elements.gain * works)


def known_signals(plan: Plan, frame: Frame, signals: Signals) -> Signals:
    """Signals as processing has them: corrected of what it knows of the errors of the channels."""
    errors, drawn = plan.scene.sonar.sensor_errors, errors_of(plan, frame)
    if errors is None or drawn is None:
        return signals
    sound_speed = plan.scene.sonar.assumed_sound_speed
    return channel_errors.corrected(signals, errors, drawn, sound_speed)
