"""Rows of a plan for each part of the noise: its level, what its coherence errs by, and what it costs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import REFERENCE_PRESSURE, depth, evenly
from sonarsynth.description.method import FrameSize
from sonarsynth.environment.noise import Noise
from sonarsynth.environment.noise.noise_field import SECONDS as DRAW_SECONDS
from sonarsynth.geometry.motion import pose
from sonarsynth.planning.listening_windows import frame_start
from sonarsynth.planning.measured.sampled_frames import MAX_SAMPLED_FRAMES
from sonarsynth.receiver import SensorErrors
from sonarsynth.signals.noise.drawing import coherence_error, seconds
from sonarsynth.sources.noise_source import NoiseRecording, NoiseSource

if TYPE_CHECKING:
    from sonarsynth.planning.plans import Plan

ELECTRONICS, SENSORS, DISTANT_CHORUS = "electronics", "sensors", "distant chorus"
"""Stages beside the parts of the noise."""
SIGNAL_TO_NOISE = "signal to noise"
SNR_BEAMS = 1024
"""Most beams of a target that its signal to noise is taken in, spread evenly over all of its beams. The energy of a
ball that fills 1453 beams of ROMANIS errs by 0.03 dB; with 64 beams by 1.5 dB, for it glints in few."""
PATH_SECONDS = 150e-9
"""Of one core for a sample of one hydrophone of a source of noise."""
PLAYED_SECONDS = 70e-9
"""Of one core for a sample of one hydrophone of a recording that is played."""
ERROR_SECONDS = 5e-9
"""Of one core to filter a sample of one channel."""
LEAST_OFF = 1e-3
"""degree: a source of noise that passes by less in a record stands still."""
NoiseRow = tuple[str, str, str, str, float, int]
"""As `costs.Row`."""


def part_names(noises: tuple[Noise, ...]) -> tuple[str, ...]:
    """What each part of the noise is called: by its kind, numbered where there are several."""
    kinds = [noise.kind for noise in noises]
    return tuple(
        f"noise {kind}" + (f" {kinds[:n].count(kind) + 1}" if kinds.count(kind) > 1 else "")
        for n, kind in enumerate(kinds)
    )


def noise_rows(plan: Plan, size: FrameSize) -> list[NoiseRow]:
    """A row for each part of the noise."""
    scene, elements = plan.scene, plan.elements
    noises = scene.world.environment.noises
    sonar_pose = plan.recipe.frame(plan.recipe.first_frame(plan.sequence))[1].sonar_pose
    sound_speed = float(plan.profile.at(depth(sonar_pose.position)))
    centre, rows = np.array([scene.sonar.band.centre]), list[NoiseRow]()
    distant = [] if plan.distant_chorus is None else [(DISTANT_CHORUS, plan.distant_chorus)]
    for name, noise in [*zip(part_names(noises), noises, strict=True), *distant]:
        level = 10.0 * np.log10(float(noise.density(centre)[0]) / REFERENCE_PRESSURE**2)
        text = f"{level:.1f} dB re 1 uPa2/Hz at {centre[0] / 1e3:.3g} kHz"
        method, error, work = (
            "independent between hydrophones",
            "none",
            noise.cost(size),
        )
        if noise.directions is not None:
            wrong, method = coherence_error(noise.directions, elements, sonar_pose, scene.sonar, sound_speed)
            method, error = (
                f"{getattr(noise.directions, 'kind', 'by its directions')}: {method}",
                f"{wrong:.2g} of the coherence",
            )
            work = seconds(noise.directions, elements, plan.sizes["sample"])
        if noise.played:
            method, error = f"{getattr(noise.directions, 'kind', 'one')}: a plane wave each 2 ms", "none on average"
            work = PLAYED_SECONDS * plan.sizes["sensor"] * plan.sizes["sample"]
        elif noise.correlated:
            method = "by its cross spectral density"
        rows.append((name, f"{noise.row()}, {method}", text, error, work, 0))
    return [*rows, *_source_rows(plan), *_channel_rows(plan)]


def _source_rows(plan: Plan) -> list[NoiseRow]:
    """Rows of the sources of noise."""
    rows, samples, centre = list[NoiseRow](), plan.sizes["sensor"] * plan.sizes["sample"], plan.scene.sonar.band.centre
    for source in plan.scene.world.noise_sources:
        text = "as recorded"
        if not isinstance(source.sound, NoiseRecording):
            density = float(source.sound.density(np.array([centre]))[0])
            level = 10.0 * np.log10(density / REFERENCE_PRESSURE**2)
            text = f"{level:.1f} dB re 1 uPa2/Hz at 1 m and {centre / 1e3:.3g} kHz"
        method = f"{source.sound.kind} from one place, each path at each hydrophone"
        off = _passing(plan, source)
        error = f"at one place in a record: directions up to {off:.2g} degrees off" if off > LEAST_OFF else "none"
        rows.append((f"noise of {source.name}", method, text, error, PATH_SECONDS * samples, 0))
    return rows


def _passing(plan: Plan, source: NoiseSource) -> float:
    """How far (degree) a source and the array pass each other from the middle of a record to its ends, at most, by the
    frames that a plan samples of one sequence."""
    trajectory, off = plan.scene.trajectory, 0.0
    half = 0.5 * plan.windows.samples / plan.scene.sonar.sampling_frequency
    first_frame = plan.recipe.first_frame(plan.sequence)
    for step in evenly(trajectory.frames, MAX_SAMPLED_FRAMES):
        frame = plan.recipe.frame(first_frame + step)[1]
        middle = frame.time + frame_start(plan, frame) + half
        now, *ends = (
            pose(source.motion, at).position - pose(trajectory.sonar, at).position
            for at in (middle, middle - half, middle + half)
        )
        for then in ends:
            across = float(np.linalg.norm(np.cross(now, then)))
            off = max(off, float(np.rad2deg(np.arctan2(across, now @ then))))
    return off


def _channel_rows(plan: Plan) -> list[NoiseRow]:
    """Rows of the errors of the channels and of their noise."""
    sonar, rows, sizes = plan.scene.sonar, list[NoiseRow](), plan.sizes
    samples = sizes["sensor"] * sizes["sample"]
    if (errors := sonar.sensor_errors) is not None:
        usual = SensorErrors()
        changed = [name for name in vars(usual) if getattr(errors, name) != getattr(usual, name) and name != "known"]
        method = f"{', '.join(changed) or 'no errors'}; processing knows {errors.known}"
        off = 2.0 * np.pi * sonar.band.high / sonar.assumed_sound_speed * errors.position
        aside = (
            f"{(1.0 - np.sqrt(0.5)) * off:.2g} rad rms off for sound from 45 degrees aside, {2.0 * off:.2g} from behind"
        )
        error = f"positions along the axis as delays of sound from ahead: {aside}" if off else "none"
        rows.append(
            (SENSORS, method.replace("_", " "), "requested", error, ERROR_SECONDS * samples, 36 * sizes["sensor"])
        )
    if sonar.electronics is not None:
        text = f"{sonar.electronics.level:.1f} dB re 1 uPa2/Hz"
        rows.append((ELECTRONICS, "independent between channels", text, "none", DRAW_SECONDS * samples, 0))
    return rows
