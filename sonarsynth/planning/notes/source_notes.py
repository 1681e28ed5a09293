"""Where the sources of a recipe stand, as the sonar is told; and where it hears what, as it moves, and twice."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.fft import irfft

from sonarsynth.conventions import Floats
from sonarsynth.description.method import Demand
from sonarsynth.environment.boundary_numbers import rms_height
from sonarsynth.equations.arrays.grating_lobes import loudest_lobe
from sonarsynth.planning.listening_windows import frame_start
from sonarsynth.planning.measured.sampled_frames import SampledScene
from sonarsynth.planning.plans import Plan
from sonarsynth.planning.pulse_durations import extreme_waveforms
from sonarsynth.propagation.images import boundary_at
from sonarsynth.ranging import LocatingMethod
from sonarsynth.ranging.picking.beyond_the_grid import FARTHEST
from sonarsynth.ranging.range_profiles import aperture_moments
from sonarsynth.receiver import elements
from sonarsynth.recipe.scene import Scene
from sonarsynth.signals.filtered_pulse import pulse_spectrum
from sonarsynth.signals.isolated_paths import whole_spectrum
from sonarsynth.sources import snap_pulses

OUT_OF_BAND = -20.0
"""Peak (dB) of a pulse in the band over that of all of it, under which a source is out of it; snaps have -7."""
OFF = 3.0
"""A source this many standard errors of the bottom's depth above the bottom stands off it."""
OFF_MIRROR = 1e-4
"""The same where the bottom mirrors it, m: at 1 mm its image moves its time by 0.3 us, ten times what is predicted of
one on the bottom."""
OTHER_WATER = 2.0
"""A speed of sound so many standard errors from the water's is taken for another: with what else errs, places are then
past three predicted errors in more than one of twenty frames."""
OBLIQUE = 45
"""Angle (deg) off the axis of a plane array of which the note on the speed of sound says by how much it errs."""
LOBE = 0.1
"""Energy of a grating lobe over that of the main lobe, up to which nothing is said: no shipped snap has one as loud."""
PULSE_SAMPLES = 4096
"""Of the spectra of pulses whose lobes are looked at."""
STEERED = 0.25
"""Part of the step between beams by which echoes may be off in images without a word."""


def standing_off(scene: Scene) -> tuple[str, ...]:
    """Names of the sources that are not on the bottom, to what the sonar knows of its depth."""
    bottom, start = scene.world.environment.depth, scene.trajectory.start
    least = OFF_MIRROR if scene.physics.tracing.bounces else OFF * scene.sonar.bed_depth_error
    height = {source.name: float(source.position_at(bottom, start)[2]) + bottom for source in scene.sources}
    return tuple(name for name, up in height.items() if up > least)


def locator(scene: Scene) -> LocatingMethod:
    """How the sonar locates sources, knowing what it is told of where they stand."""
    off_bottom, reflected = bool(standing_off(scene)), scene.physics.tracing.bounces > 0
    demand = Demand(0.0, False, lambda method: 0.0, off_bottom=off_bottom, reflected=reflected)
    locating: LocatingMethod = scene.processing.locating.resolve(demand)[0]
    return locating


def off_the_bottom(scene: Scene) -> list[str]:
    """Which sources the sonar does not find where it may look for them."""
    names, note = standing_off(scene), scene.processing.locating.off_bottom_note()
    return [f"{', '.join(names)}: not on the bottom; {note}"] if names and note else []


def cancelled_by_image(scene: Scene) -> list[str]:
    """Which sources are cancelled by their image in the smooth boundary that they lie on, as at the surface."""
    environment, start, names = scene.world.environment, scene.trajectory.start, []
    for source in scene.sources if scene.physics.tracing.bounces else ():
        down = -float(source.position_at(environment.depth, start)[2])
        at = boundary_at(down, environment.depth)
        if at and source.directivity(start) is None:
            boundary = environment.bottom if at == "bottom" else environment.surface
            value = boundary.reflection.coefficient(np.array([0.25 * np.pi]))[0]
            names += [source.name] if rms_height(boundary) == 0.0 and abs(1.0 + value) < 1e-9 else []
    line = "its image in the boundary that it lies on cancels it: nothing of it is heard"
    return [f"{', '.join(names)}: {line}"] if names else []


def unlit(plan: Plan) -> list[str]:
    """Whether nothing sounds whose echoes could be heard: noise and the chorus light nothing."""
    if plan.sizes["emission"] or not plan.sizes["target"]:
        return []
    return ["no source sounds: no target sends an echo, and there are no points (scene.world.sources)"]


def unlocated(scene: Scene) -> list[str]:
    """Why nothing is located, where that is known beforehand."""
    why = locator(scene).locates_nothing(elements(scene.sonar.array), scene.sonar.band)
    return (
        [f"no snap is located, so there are no points, and images are of the end of the record: {why}"] if why else []
    )


def out_of_band(scene: Scene) -> list[str]:
    """Which sources send next to nothing in the band of the sonar: echoes of theirs are not heard."""
    lines, sonar = [], scene.sonar
    for source in (source for source in scene.sources if source.times):
        shape = snap_pulses.waveform(source.model(scene.world.environment.depth))
        f, spectrum = whole_spectrum(shape, sonar)
        pressure = irfft(np.where((f >= sonar.band.low) & (f <= sonar.band.high), spectrum, 0.0)) * 2.0 * f[-1]
        peak = shape.model.pulse(0.0, float(f[-1])).peak
        over = 20.0 * np.log10(max(float(np.abs(pressure).max()) / peak, 1e-10)) if np.isfinite(peak) else 0.0
        if over < OUT_OF_BAND:
            lines.append(
                f"{source.name}: what its pulse has in the band of the sonar, {sonar.band.low / 1e3:g} to "
                f"{sonar.band.high / 1e3:g} kHz, is {-over:.0f} dB under its source level: its echoes are faint or not "
                "there (scene.sonar.band)"
            )
    return lines


def assumed_speed_notes(looks: Sequence[SampledScene]) -> list[str]:
    """Where the sonar takes the water about it for other water than it knows that it may be, in the worst sequence."""
    worst, lines = OTHER_WATER, []
    for look in looks:
        sonar, depth = look.scene.sonar, -float(look.frames[0].sonar_pose.position[2])
        assumed, error, speed = sonar.assumed_sound_speed, sonar.sound_speed_error, float(look.profile.at(depth))
        if abs(speed - assumed) > worst * error:
            worst = abs(speed - assumed) / max(error, 1e-9)
            lines = [
                f"the sonar assumes sound at {assumed:g} m/s, good to {error:g} m/s, and the water about it has "
                f"{speed:.5g} m/s: directions {OBLIQUE} deg off the axis of a plane array err by "
                f"{oblique_error(assumed / speed):.2g} deg, those beyond by more, and places are further off than "
                "predicted (scene.sonar.assumed_sound_speed)"
            ]
    return lines


def oblique_error(ratio: float) -> float:
    """By how much (deg) directions `OBLIQUE` to the axis of a plane array err; ratio: sound speed assumed over true."""
    return abs(float(np.rad2deg(np.arcsin(min(ratio * np.sin(np.deg2rad(OBLIQUE)), 1.0)))) - OBLIQUE)


def steering_notes(looks: Sequence[SampledScene]) -> list[str]:
    """How far off echoes are at the edges of the images of a sonar that moves: beams are steered as at rest."""
    worst, lines = STEERED, []
    for look in looks:
        beams = look.scene.sonar.beams
        azimuth, elevation = np.meshgrid(beams.azimuth[[0, -1]], beams.elevation[[0, -1]])
        across = np.cos(elevation) * np.sin(azimuth)
        corners = np.stack([np.cos(elevation) * np.cos(azimuth), across, np.sin(elevation)], axis=-1)
        step = max(beams.azimuth_span / max(beams.azimuths - 1, 1), beams.elevation_span / max(beams.elevations - 1, 1))
        for frame in look.frames:
            approach = corners @ frame.sonar_pose.turn_to_body(frame.sonar_velocity)
            speed = float(look.profile.at(-float(frame.sonar_pose.position[2])))
            off = float(np.abs(steering_error(np.arccos(corners[..., 0]), approach / speed)).max())
            if off > worst * step:
                worst, fast = off / step, np.linalg.norm(frame.sonar_velocity)
                lines = [
                    f"images are steered as for a sonar at rest: at {fast:.3g} m/s echoes at their edges appear "
                    f"{np.rad2deg(off):.2g} deg off where they come from (points do not)"
                ]
    return lines


def direction_notes(looks: Sequence[SampledScene]) -> list[str]:
    """Along which axes of its beams an array tells no directions: those across which it has no extent."""
    from sonarsynth.ranging.picking.peak_picking import RESOLVED  # it loads what plans need not

    lines = []
    for look in looks:
        sonar, beams, array = look.scene.sonar, look.scene.sonar.beams, elements(look.scene.sonar.array)
        k = 2.0 * np.pi * sonar.band.centre / sonar.assumed_sound_speed
        extent = np.sqrt(np.diag(aperture_moments(array))[1:])
        axes = (("azimuth", beams.azimuth_span, beams.azimuths), ("elevation", beams.elevation_span, beams.elevations))
        unknown = [axis for (axis, span, n), x in zip(axes, extent, strict=True) if n > 2 and k * x * span <= RESOLVED]
        if unknown:
            count = int(np.count_nonzero(array.gain))
            tell = "one hydrophone tells" if count == 1 else f"{count} hydrophones, of no extent there, tell"
            lines.append(
                f"{tell} no {' and no '.join(unknown)} of echoes: points may be at any, as their predicted errors say "
                "(scene.sonar.array)"
            )
    return lines


def lobe_notes(looks: Sequence[SampledScene]) -> list[str]:
    """How loud grating lobes of echoes are in images, where points may be found in them: of the worst sequence; and of
    hydrophones that are farther apart than echoes beyond the beams are looked for."""
    worst, lines, sparse = LOBE, list[str](), list[str]()
    for look in looks:
        sonar = look.scene.sonar
        array, c = elements(sonar.array), sonar.assumed_sound_speed
        if not array.on_lattice:
            continue
        beams, wavelengths = sonar.beams, array.pitch * sonar.band.high / c
        if (1.0 + np.sin(0.5 * max(beams.azimuth_span, beams.elevation_span))) * wavelengths > FARTHEST + 1:
            sparse = [
                f"hydrophones are {wavelengths:.3g} wavelengths apart: echoes from beyond the beams are looked for "
                f"along {FARTHEST} orders of grating lobes either way, and points may be found in the others"
            ]
        live = array.gain != 0.0
        for waveform in extreme_waveforms(look.scene):
            f, spectrum = pulse_spectrum(waveform, sonar.antialias, sonar.sampling_frequency, PULSE_SAMPLES)
            band = (f >= sonar.band.low) & (f <= sonar.band.high)
            for place, span in ((array.column, sonar.beams.azimuth_span), (array.row, sonar.beams.elevation_span)):
                apart = 2.0 * float(np.sin(0.5 * span))
                pulse = f[band], np.abs(spectrum[band]) ** 2
                sine, level = loudest_lobe(np.bincount(place[live]), array.pitch, *pulse, c, apart)
                if level > worst:
                    worst, degrees = level, np.rad2deg(2.0 * np.arcsin(0.5 * sine))
                    lines = [
                        f"hydrophones are {array.pitch * 1e3:.3g} mm apart: images have a grating lobe of each echo "
                        f"about {degrees:.0f} deg beside it, {max(-10.0 * np.log10(level), 0.0):.1f} dB below it, and "
                        "points may be found in it (origin 'grating lobe')"
                    ]
    return lines + sparse


def steering_error(off_axis: Floats, approach: Floats) -> Floats:
    """Angle (rad) by which a flat array that moves hears a wave farther from its axis than it comes from.

    A front passes the sensors sooner after each other by 1 + approach, so sin(heard) = sin(off_axis)/(1 + approach): an
    echo of remus.yaml at 22 degrees is seen 0.14 degrees nearer to the axis at 10 m/s.

    off_axis: rad, of where the wave comes from, below pi/2. approach: speed of the array towards there, over that of
    sound. Both of any shape, that of the result.
    """
    return np.asarray(np.arcsin(np.clip(np.sin(off_axis) / (1.0 + approach), -1.0, 1.0)) - off_axis)


def unheard_scatterers(plan: Plan) -> list[str]:
    """Scatterers without a body of which no echo comes within the record of the first frame: it is as long as those of
    targets need."""
    frame = plan.recipe.frame(plan.recipe.first_frame(plan.sequence))[1]
    start, array, lines = frame_start(plan, frame), frame.sonar_pose.position, list[str]()
    stop = start + plan.windows.samples / plan.scene.sonar.sampling_frequency
    lit = [snap for snap in frame.moment.snaps if snap.illuminates]
    for number, field in enumerate(frame.moment.scatterers):
        back = np.linalg.norm(field.position - array, axis=1)
        took = [
            snap.time + (np.linalg.norm(field.position - snap.position, axis=1) + back) / _speed(plan) for snap in lit
        ]
        heard = np.concatenate([np.zeros(0), *took])
        if lit and not ((heard > start) & (heard < stop)).any():
            when = (
                f"no echo of them comes within the record of the first frame, {1e3 * start:.3g} to {1e3 * stop:.3g} ms"
            )
            first = f"the first {1e3 * heard.min():.3g} ms after its instant"
            lines.append(f"scene.world.scatterers.{number}: {when}, but {first}: see scene.processing.echo_window")
    return lines


def _speed(plan: Plan) -> float:
    """Of sound (m/s), on average from surface to bottom."""
    return float(np.mean(plan.profile.at(np.linspace(0.0, plan.medium.depth, 9))))
