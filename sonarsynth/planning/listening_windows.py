"""When each frame listens: the sample window and the echo window, from geometry alone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np

from sonarsynth.conventions import Floats, Ints, depth
from sonarsynth.description import FieldError
from sonarsynth.environment.sea import Profile
from sonarsynth.equations.kernels.placing import distances
from sonarsynth.equations.rays.ray_solutions import mean_slowness, water
from sonarsynth.geometry import Pose
from sonarsynth.geometry.mesh import in_blocks
from sonarsynth.planning.measured.ray_bending import unlike_straight
from sonarsynth.planning.measured.sampled_frames import SampledScene
from sonarsynth.planning.plans import Plan, PulseDurations, Windows
from sonarsynth.planning.pulse_durations import blur_of, lateness, supports_of
from sonarsynth.products import Paths
from sonarsynth.propagation import Straight
from sonarsynth.receiver import Band, RangeGrid, Sonar
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.scene import Frame, Scene
from sonarsynth.scattering.scatterers import AT_REST
from sonarsynth.signals.filtered_pulse import snap_levels

MARGIN = 0.1e-3
"""Seconds added at both ends of every window. Covers what straight rays leave out of an arrival time: under 2 us at
20 m in a gradient of 4 per second. Arrivals that still fall outside are counted in `/signals/outside`."""

SHORTEST = 1e-3
"""s: no echo window is shorter."""
IN_LOBES, IN_BANDWIDTHS, IN_PULSES = 2.0, 40.0, 12.0
"""An echo window opens so many inverses of the bandwidth before the first echo, and lasts so many, or so many pulses,
at least: echoes are told from noise by the median of a beam over the window. In a shorter one that is the echo's own:
in a band of 3 kHz it was 60 dB over the noise, and in one of 2 kHz no echo was ever picked."""

UNSAMPLED_MARGIN = 0.1
"""Windows of datasets of which not every frame is looked at are wider by this part of themselves."""


def listening_windows(recipe: Recipe, looks: Sequence[SampledScene]) -> Windows:
    """The sample window, which holds every arrival of every frame, and the echo window.

    The sonar takes the pulse that it hears best for the start of its clock: the echo window holds the echoes of any
    snap after its own direct arrival. From geometry alone: the delay of each facet's echo along straight lines at the
    slowness averaged between its ends, and the support of the filtered snap. Where not every frame was looked at, the
    windows are wider by UNSEEN, and each other frame is asked whether it fits when it is rendered.
    """
    sonar, gate = looks[0].scene.sonar, looks[0].scene.processing.echo_window
    supports = supports_of(looks)
    real = np.array([frame.index if look.real else -1 for look in looks for frame in look.frames])
    spans = [span for look in looks for span in _spans(look)]
    times = np.array([(s.first, s.last_clock, s.first_echo, s.last_echo, s.last) for s in spans])
    first_heard, last_clock, first_echo, last_echo, last_heard = times.T
    echoes = bool(np.isfinite(first_echo).any())
    shortest = float(np.nanmin(first_echo)) if echoes else np.nan
    longest = float(np.nanmax(last_echo)) if echoes else np.nan
    if (grid := sonar.ranges) is not None:  # heard from the first cell to the last
        shortest, longest = _with_ranges(grid, sonar.assumed_sound_speed, looks, shortest, longest)
        echoes = True
    unseen = UNSAMPLED_MARGIN * (longest - shortest) if (real >= 0).sum() < recipe.frames else 0.0
    removed, start = _opening(looks[0].scene, shortest, supports, MARGIN + unseen)
    latest = longest + supports.echo_after + MARGIN + unseen
    if not echoes:  # listen for a moment after the snap
        latest = supports.after + 2e-3
    stop = gate.stop if gate.stop is not None else max(latest, start + _shortest(sonar.band, supports.direct))
    if stop <= start:
        raise FieldError(("scene", "processing", "echo_window", "stop"), f"must be after start ({start:g} s)")
    rate = sonar.sampling_frequency
    first = _first_sample(first_heard, supports, rate)
    last = np.maximum(last_heard + supports.after, last_clock + stop) + MARGIN
    samples = int(np.ceil(np.max(last - first) * rate * (1.0 + (UNSAMPLED_MARGIN if unseen else 0.0)))) + 1
    disturbed = sum(_disturbed(span, start - supports.before, stop + supports.before) for span in spans)
    starts = np.full(recipe.frames, np.nan)
    starts[real[real >= 0]] = first[real >= 0]
    cut = echoes and (start > shortest - supports.foot or stop < longest + supports.foot)
    tight = tuple(int(n) for n in dict.fromkeys(real[[*_first(first_echo, real), *_first(-last_echo, real)]]))
    return Windows(starts, samples, float(start), float(stop), supports, disturbed, removed, cut, tight)


def _with_ranges(
    grid: RangeGrid, speed: float, looks: Sequence[SampledScene], first: float, last: float
) -> tuple[float, float]:
    """First and last echo (s), NaN for none, with what may be heard from ranges by any source."""
    away = [np.linalg.norm(s.position - f.sonar_pose.position) for k in looks for f in k.frames for s in f.moment.snaps]
    nearest = 2.0 * max(grid.near - float(max(away, default=0.0)), 0.0) / speed
    return float(np.nanmin([first, nearest])), float(np.nanmax([last, 2.0 * grid.range[-1] / speed]))


def _shortest(band: Band, pulse: float) -> float:
    """How long (s) an echo window is at least; pulse (s): how long either side of its peak a direct one is heard."""
    return max(SHORTEST, IN_BANDWIDTHS / (band.high - band.low), IN_PULSES * pulse)


def _first(times: Floats, real: Ints) -> Ints:
    """Indices of the smallest two of times (frame,) in frames of the dataset; NaN counts as late."""
    order = np.argsort(times, kind="stable")
    return np.asarray(order[(real[order] >= 0) & np.isfinite(times[order])][:2])


def _opening(scene: Scene, first_echo: float, supports: PulseDurations, margin: float) -> tuple[bool, float]:
    """Whether the direct pulse is taken out, and when the echo window opens (s), both after it.

    first_echo (s): NaN where nothing echoes. The window opens when the direct pulse is over. Where that cuts more than
    the feet of an echo the direct pulse is taken out, and the window opens with the echoes, which never come before it.
    """
    gate, chosen = scene.processing.echo_window.start, scene.processing.direct_pulse
    before = max(supports.echo_before, IN_LOBES / (scene.sonar.band.high - scene.sonar.band.low))
    earliest, unclipped = first_echo - before - margin, first_echo - supports.foot - margin
    overlap = (unclipped if gate is None else gate) < supports.clear
    removed = chosen == "remove" or (chosen == "auto" and overlap)
    if gate is not None:
        return removed, gate
    if np.isnan(first_echo):
        return removed, supports.after
    return removed, max(unclipped, 0.0) if removed and overlap else max(earliest, supports.clear)


def _first_sample(first_heard: Floats, supports: PulseDurations, rate: float) -> Floats:
    return np.asarray(np.floor((first_heard - supports.before - MARGIN) * rate) / rate)


def frame_start(plan: Plan, frame: Frame) -> float:
    """Time (s) of the first sample of a frame, after its instant; `plan` is that of its sequence.

    Raises FieldError for a frame that was not looked at before and does not fit in the windows.
    """
    planned = float(plan.windows.start[frame.index])
    return planned if np.isfinite(planned) else _new_start(plan, frame)


@lru_cache(maxsize=32)  # every stage of a frame asks for it, and frames go through each together
def _new_start(plan: Plan, frame: Frame) -> float:
    """As `frame_start`, of a frame that was not looked at before."""
    windows, scene = plan.windows, plan.scene
    (span,) = _spans(SampledScene(scene, plan.profile, (frame,)))
    supports, rate, gate = windows.supports, scene.sonar.sampling_frequency, scene.processing.echo_window
    first = float(_first_sample(np.asarray(span.first), supports, rate))
    last = max(span.last + supports.after, span.last_clock + windows.echo_stop) + MARGIN
    path, advice = ("scene", "processing", "echo_window"), "give its start and stop, or fewer frames"
    if np.ceil((last - first) * rate) + 1 > windows.samples:
        raise FieldError(
            path, f"frame {frame.index} lasts {last - first:.3g} s, longer than the sampled frames: {advice}"
        )
    removed, opens = _opening(scene, span.first_echo, supports, 0.0)
    early = opens < windows.echo_start or (removed and not windows.direct_removed)
    late = gate.stop is None and span.last_echo + supports.echo_after > windows.echo_stop
    if early or late:
        raise FieldError(path, f"frame {frame.index} has echoes outside the window of the sampled frames: {advice}")
    return first


def _slack(doppler: bool, frame: Frame, span: _ArrivalInterval, profile: Profile) -> float:
    """By how much (s) arrivals may come before or after what straight lines between things at rest say.

    What moves at v changes the travel time of each leg at v/c. A ray between two points r apart, in a sound speed that
    changes by g a metre at most, is faster by r^3 g^2/(24 c^3), and no faster or slower than the extreme speeds let it
    be.
    """
    slowest = float(profile.speed.min())
    latest = max(abs(span.last), abs(span.first))
    moved = 0.0
    if doppler:
        fastest = max((float(np.linalg.norm(b.velocity)) for b in frame.moment.bodies), default=0.0)
        moved = 2.0 * (fastest + float(np.linalg.norm(frame.sonar_velocity))) * latest / slowest
    if profile.uniform:
        return moved
    length = slowest * (span.last - min((s.time for s in frame.moment.snaps), default=0.0))  # m, of all legs together
    with np.errstate(divide="ignore", invalid="ignore"):
        gradient = float(np.nanmax(np.abs(np.diff(profile.speed)) / np.diff(profile.depth), initial=0.0))
    bent = length**3 * gradient**2 / (24.0 * slowest**3)
    return moved + min(bent, length / slowest - length / float(profile.speed.max()))


@dataclass(frozen=True)
class _ArrivalInterval:
    """When a frame is heard at the array centre (s)."""

    first: float  # first direct arrival of any snap
    clock: float  # peak of the direct pulse of the loudest snap: what the sonar takes for the start
    last_clock: float  # of any snap
    first_echo: float  # of any snap, after its own direct pulse; NaN where nothing echoes
    last_echo: float
    last: float  # last arrival of any snap
    others: tuple[tuple[float, float], ...] = ()  # direct arrival and last echo of the snaps that are not the loudest


def _spans(look: SampledScene) -> list[_ArrivalInterval]:
    """When each frame is heard, with what straight lines between things at rest leave out."""
    scene, profile = look.scene, look.profile
    bounces, bottom_depth = scene.physics.tracing.bounces, scene.world.environment.depth
    blurred, spans = blur_of(scene), []
    for frame in look.frames:
        span = _span(frame, scene.sonar, profile, bottom_depth, bounces)
        slack = _slack(scene.physics.doppler, frame, span, profile)
        if not scene.physics.tracing.layered:
            slack += unlike_straight(scene.physics.tracing, frame, profile, bottom_depth)
        spans.append(
            replace(
                span,
                first=span.first - slack,
                last_clock=span.last_clock + slack,
                first_echo=span.first_echo - 2.0 * slack,  # the direct arrival may err, and the echo
                last_echo=span.last_echo + 2.0 * slack + blurred,
                last=span.last + slack + blurred,
            )
        )
    return spans


def _span(frame: Frame, sonar: Sonar, profile: Profile, bottom_depth: float, bounces: int) -> _ArrivalInterval:
    array = frame.sonar_pose.position
    snaps = frame.moment.snaps
    if not snaps:
        return _ArrivalInterval(0.0, 0.0, 0.0, np.nan, np.nan, 0.0)
    straight = partial(_straight_time, profile, bottom_depth)
    direct = np.array([s.time + float(straight(AT_REST.pose, s.position[None], array)[0]) for s in snaps])
    earliest, late_echo = np.full(len(snaps), np.inf), [-np.inf] * len(snaps)
    blocks = [(body, facets) for body in frame.moment.bodies for facets in in_blocks(len(body.mesh.faces))]
    for body, facets in blocks:
        points = body.mesh.centroid[facets]
        back = straight(body.pose, points, array)
        for n, snap in ((n, snap) for n, snap in enumerate(snaps) if snap.illuminates):
            echo = snap.time + straight(body.pose, points, snap.position) + back
            earliest[n] = min(earliest[n], echo.min(initial=np.inf))
            late_echo[n] = max(late_echo[n], echo.max(initial=-np.inf))
    echoes = bool(np.isfinite(earliest).any())
    late_direct = direct
    if bounces:
        late_direct, late_echo = _reflected(frame, profile, bottom_depth, bounces)
    last = np.maximum(late_direct, late_echo)
    away = [max(math.dist(s.position, array), 1e-9) for s in snaps]
    loudest = int(np.argmax(snap_levels(snaps) - 20.0 * np.log10(away)))
    clock = direct + [lateness(s.waveform, sonar) for s in snaps]
    latest = float(np.max(np.asarray(late_echo) - clock)) if echoes else np.nan
    others = tuple((float(direct[n]), float(last[n])) for n in range(len(snaps)) if n != loudest)
    return _ArrivalInterval(
        first=float(direct.min()),
        clock=float(clock[loudest]),
        last_clock=float(clock.max()),
        first_echo=float((earliest - clock).min()) if echoes else np.nan,
        last_echo=latest,
        last=float(last.max()),
        others=others,
    )


def _reflected(frame: Frame, profile: Profile, bottom_depth: float, bounces: int) -> tuple[Floats, list[float]]:
    """Last direct arrival and last echo (s) of each snap by so many reflections, from the boxes round the bodies.

    The length of a path by image sources is convex in the point that it meets, so a corner of the box is the farthest.
    """
    straight, array = Straight(bounces=bounces), frame.sonar_pose.position
    points = np.concatenate([np.empty((0, 3)), *(body.box for body in frame.moment.bodies)])
    points[:, 2] = np.clip(points[:, 2], -bottom_depth, 0.0)
    back = straight.connect(profile, bottom_depth, points, np.broadcast_to(array, points.shape))
    direct, echoes = [], []
    for snap in frame.moment.snaps:
        start = snap.position[None, :]
        direct.append(snap.time + straight.connect(profile, bottom_depth, start, array[None, :]).travel_time.max())
        out = straight.connect(profile, bottom_depth, np.broadcast_to(start, points.shape), points)
        latest = -np.inf
        for n in range(bounces + 1 if snap.illuminates else 0):
            first, second = (_latest(paths, k, len(points)) for paths, k in ((out, n), (back, bounces - n)))
            latest = max(latest, float(np.max(first + second, initial=-np.inf)))
        echoes.append(snap.time + latest)
    return np.array(direct), echoes


def _latest(paths: Paths, bounces: int, points: int) -> Floats:
    """Longest travel time (point,) of paths with at most so many reflections."""
    selected = paths.surface + paths.bottom <= bounces
    out = np.zeros(points)
    np.maximum.at(out, paths.pair[selected], paths.travel_time[selected])
    return out


def _disturbed(span: _ArrivalInterval, start: float, stop: float) -> bool:
    """Whether sound of another snap than the loudest falls into the echo window, start to stop after its arrival."""
    return any(first < span.clock + stop and last > span.clock + start for first, last in span.others)


def _straight_time(profile: Profile, bottom_depth: float, pose: Pose, points: Floats, place: Floats) -> Floats:
    """Travel time (point,) along straight lines from points (point, xyz) of a body at a pose to a place (xyz) in the
    world: distance times the mean slowness between them."""
    distance = distances(points, pose.to_body(place))
    if profile.uniform:
        return np.asarray(distance / profile.speed[0])
    down = -(points @ pose.rotation[2] + pose.position[2])
    ends = down, np.broadcast_to(depth(place), len(points))
    return np.asarray(distance * mean_slowness(water(profile.depth, profile.speed, bottom_depth), *ends))
