"""What a plan leaves out of the motion of targets and sonar while sound is under way, and what that costs; and what
ranging makes of that motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.geometry import turned
from sonarsynth.planning.listening_windows import frame_start
from sonarsynth.planning.measured.sampled_arrivals import context_of
from sonarsynth.planning.measured.sampled_frames import SampledScene
from sonarsynth.planning.plan_tables import Omission
from sonarsynth.planning.plans import Plan
from sonarsynth.planning.pulse_durations import Stretch, ranged_echo, stretches
from sonarsynth.recipe.scene import Frame
from sonarsynth.state import FrameContext
from sonarsynth.tracing.meetings import MeetingTimes, meetings

FAINTER = 1.0
"""dB by which motion may make echoes fainter in ranging without a word."""


def stretch_notes(looks: Sequence[SampledScene], allowed: float) -> list[str]:
    """How far off the ranges of echoes are that motion makes longer than the direct pulse, and how much fainter they
    are in ranging, in the worst sequence: where ranges are off by more than is allowed (m), or echoes fainter."""
    worst, lines = 1.0, []
    for look in looks:
        sonar, c = look.scene.sonar, look.scene.sonar.assumed_sound_speed
        rows = stretches(look)
        stretch, by_path, waveform, _ = max(rows, key=lambda row: abs(row.longer) * row.by_path, default=Stretch())
        echo = ranged_echo(stretch, waveform, sonar)
        off, lost = by_path * c * echo.late, -10.0 * np.log10(max(echo.power, 1e-30))
        if max(abs(off) / allowed, lost / FAINTER) > worst:
            worst = max(abs(off) / allowed, lost / FAINTER)
            than = f"{1e2 * abs(stretch):.2g} % {'longer' if stretch > 0.0 else 'shorter'} than the direct pulse"
            ranges = f": ranges are {off:+.2g} m off, which their predicted errors hold"
            fainter = f": the sonar, which looks for such as that, loses {lost:.2g} dB of them"
            over = bool(abs(off) > allowed), bool(lost > FAINTER)
            lines = [f"motion makes echoes {than}" + ranges * over[0] + fainter * over[1]]
    return lines


def motion_left_out(plan: Plan, frame: Frame) -> list[Omission]:
    """A row, where anything moves; frame: the first."""
    tracks = [frame.sonar_track, *(body.track for body in frame.moment.bodies)]
    velocities = [*(track.velocity for track in tracks), *(snap.velocity for snap in frame.moment.snaps)]
    if not np.any(velocities) and all(track.straight for track in tracks):
        return []
    if not plan.scene.physics.doppler:
        return [Omission("Doppler", "not requested: positions are those at the time of the frame", _moved(plan))]
    what, model = "bodies are posed when sound meets their middle", "the sonar when it hears that"
    why = f"{what}, {model}; from there constant velocity and spin"
    carried = Omission("motion of targets and sonar beyond constant velocity and spin", why, _carried(plan, frame))
    return [carried, *_background(plan, frame)]


def _carried(plan: Plan, frame: Frame) -> str:
    """What velocity and spin leave out, from when the first sound that is traced together meets what moves to when the
    last does, and what comes from the far side of bodies: the rest of the phase, of families as loud as they are beside
    the direct one; and how far bodies are that hide others from where they are then."""
    context, speed = context_of(plan, frame), float(plan.profile.speed.min())
    times, signal, off = meetings(context, frame.sonar_track, plan.propagation.bounces), 0.0, 0.0
    for snap in range(len(context.snaps)):
        signal = max(signal, _rest_of_direct(times, context, snap), _rest_of_echoes(times, context, snap, speed))
        off = max(off, _hiding_bodies_off(times, context, snap, speed))
    return f"{signal:.1g} of the signals; occlusion by positions up to {off:.1g} m off"


def _rest_of_direct(times: MeetingTimes, context: FrameContext, snap: int) -> float:
    direct, rest = times.direct_time[:, snap], [0.0]
    took = direct - context.snaps[snap].time
    for families, at in times.heard(snap):
        for way in range(len(direct)) if families is None else families:
            beyond = times.beyond(at.sonar, float(direct[way]) - at.arrival_time, times.aperture)
            rest.append(min(beyond, 1.0) * took[0] / took[way])
    return float(max(rest))


def _rest_of_echoes(times: MeetingTimes, context: FrameContext, snap: int, speed: float) -> float:
    rest = [0.0]
    for owners, ways in times.classes(snap):
        first, heard = times.when(snap, ways)
        sonar_time = float(heard[list(owners)].mean()) if owners else 0.0
        sonar = times.sonar.later(sonar_time)
        for n in owners:
            met, arrival_time = times.met[:, snap, n], times.arrival_time[:, :, snap, n]
            took, across = met - context.snaps[snap].time, 2.0 * context.scattering[n].radius / speed
            took = took[:, None] * (arrival_time - met[:, None])
            for out, on in times.every if ways is None else ways:
                beyond = times.beyond(sonar, float(arrival_time[out, on]) - sonar_time + across, times.aperture)
                if n < len(context.bodies):
                    body, late = context.bodies[n], float(met[out] - first[n]) + across
                    beyond += times.beyond(body.track.later(first[n]), late, body.mesh.radius)
                rest.append(min(beyond, 1.0) * took[0, 0] / took[out, on])
    return float(max(rest))


def _hiding_bodies_off(times: MeetingTimes, context: FrameContext, snap: int, speed: float) -> float:
    bodies, off = context.bodies, [0.0]
    places = [body.pose.position for body in bodies]
    for owners, ways in times.classes(snap):
        first = times.when(snap, ways)[0]
        for n in (owner for owner in owners if owner < len(bodies)):
            last = times.met[[out for out, _ in (times.every if ways is None else ways)], snap, n].max()
            others = max(float(np.linalg.norm(places[n] - place)) for place in places)
            late = last - first[n] + 2.0 * (bodies[n].mesh.radius + others) / speed
            off.append(float(np.linalg.norm(bodies[n].velocity) * late))
    return max(off)


def _background(plan: Plan, frame: Frame) -> list[Omission]:
    """What the sonar does, of which what is heard beside snaps and echoes has nothing."""
    world, rows = plan.scene.world, list[Omission]()
    half = 0.5 * plan.windows.samples / plan.scene.sonar.sampling_frequency
    middle = frame.sonar_track.later(frame_start(plan, frame) + half)
    level, (_, spin) = middle.velocity * (1.0, 1.0, 0.0), middle.in_own_frame
    off = aside = turning = 0.0
    for late in (-half, half):
        then = middle.later(late).pose
        off = max(off, float(np.linalg.norm(then.position - middle.pose.position - level * late)))
        turn = turned(np.eye(3), spin, np.full(3, late)).T
        aside = max(aside, _degrees(then.rotation - middle.pose.rotation @ turn))
        turning = max(turning, _degrees(then.rotation - middle.pose.rotation))
    if max(off, aside) > 1e-9 and (world.chorus is not None or world.reverberation is not None):
        why = "level velocity and spin, of the middle of the record"
        what = "climb and acceleration of the sonar in reverberation and chorus"
        bound = f"places up to {off:.1g} m off, directions up to {aside:.1g} degrees, in the first frame"
        rows.append(Omission(what, why, bound))
    mach = float(np.linalg.norm(middle.velocity)) / float(plan.profile.speed.min())
    if mach > 1e-9 and world.chorus is not None:
        angle = f"directions within 45 degrees of the axis up to {np.rad2deg(mach):.2g} degrees off"
        bound = f"{angle}, pulses {1e2 * mach:.2g} % too long or short"
        rows.append(Omission("Doppler in the chorus", "the array is at rest while it hears a snap", bound))
    fields = [(noise.played, of) for noise in world.environment.noises if (of := noise.directions) is not None]
    waves = any(played or of.toward is not None for played, of in fields)
    if turning > 1e-6 and (waves or world.noise_sources):  # the rest is alike in all azimuths
        why = "it comes from where it does in the middle of the record"
        bound = f"directions up to {turning:.2g} degrees off in the first frame"
        rows.append(Omission("turning of the sonar within a frame, in noise", why, bound))
    return rows


def _degrees(difference: Floats) -> float:
    """Angle between two rotations that differ little, by their difference (xyz, xyz)."""
    return float(np.rad2deg(np.linalg.norm(difference)) / np.sqrt(2.0))


def _moved(plan: Plan) -> str:
    """How far targets and sonar move while sound is under way, and how much longer pulses come out."""
    frame = plan.recipe.frame(0)[1]
    fastest = max((float(np.linalg.norm(body.velocity)) for body in frame.moment.bodies), default=0.0)
    fastest += float(np.linalg.norm(frame.sonar_velocity))
    stretch = 2 * fastest / float(plan.profile.speed.min())
    phase = 2 * np.pi * plan.scene.sonar.band.high * stretch * 50e-6
    metres = fastest * plan.windows.echo_stop
    off = f"{phase:.2g} rad over 50 us at the top of the band"
    return f"echoes up to {metres:.2g} m off; Doppler factor {stretch:.2g}, {off}"
