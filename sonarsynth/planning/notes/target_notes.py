"""What a user should know about the bodies of a plan: where laws hold for them, which overlap, which are mirrored."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from sonarsynth.casting.ray_casting import occluded
from sonarsynth.columns import alike
from sonarsynth.conventions import Floats, direction, evenly, format_bytes
from sonarsynth.equations.arrays.apertures import defocus_spread, focus_delay, live_gain
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.geometry.surfaces import longest_edge
from sonarsynth.labels.views import box_in_view
from sonarsynth.planning.measured.sampled_frames import SampledScene
from sonarsynth.planning.plans import Plan
from sonarsynth.planning.pulse_durations import extreme_waveforms
from sonarsynth.products import View
from sonarsynth.ranging.range_profiles import aperture_moments
from sonarsynth.receiver import elements
from sonarsynth.receiver.mirror_images import mirror_image, mirror_normal
from sonarsynth.recipe.scene import Frame
from sonarsynth.scattering import Scatterer
from sonarsynth.signals.filtered_pulse import pulse_spectrum
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.overlaps import overlap, sphere_round
from sonarsynth.targets.shapes import Box
from sonarsynth.targets.target import Target

MANY_FACETS = 200_000
"""Facets of a body over which what they cost is said: a frame takes seconds."""
FRAMES = 64
"""Frames of a sequence that bodies are compared in, at most; first and last among them."""
LOSS_BEAMS, LOSS_BINS = 11, 64
"""Beams each way, and frequencies of the band, by which it is said what echoes lose out of focus."""
BOX_FACES = mesh_of(Box(size=(1.0, 1.0, 1.0))).faces
"""Of the corners of `PlacedTarget.box`."""


def chosen(look: SampledScene) -> tuple[Frame, ...]:
    """So many of the frames of a look, evenly spread."""
    return tuple(look.frames[n] for n in evenly(len(look.frames), FRAMES))


def law_notes(look: SampledScene) -> list[str]:
    """Where the laws of a scene do not hold for its bodies, and what meshes stand for."""
    lines: list[str] = []
    targets = zip(look.scene.world.targets, look.scene.laws, bodies(look), strict=True)
    for target, law, body in targets:
        notes = (*body.mesh.notes, *off_origin(target, body.mesh), *law.validity(body))
        lines += [f"{target.name}: {line}" for line in notes]
    return lines


def facet_notes(plan: Plan, look: SampledScene) -> list[str]:
    """Which bodies have very many facets, what these cost, and which field says how long they are."""
    lines, seconds = [], sum(stage.seconds for stage in plan.stages)
    for target, mesh in zip(look.scene.world.targets, look.scene.meshes, strict=True):
        count, longest = len(mesh.faces), 1e3 * longest_edge((mesh.vertices, mesh.faces))
        if count <= MANY_FACETS:
            continue
        why = "as `shape.edge` says" if target.shape.edge else "short as the body is thin, for `shape.edge` is left out"
        if count > len(mesh_of(target.shape).faces):
            why = "cut for the wavelength, by scene.sonar.band.high"
        elif target.shape.plain is not None and not target.shape.edge:
            why = "as its file, `shape.path`, has them"
        lines.append(
            f"{target.name}: {count} facets up to {longest:.3g} mm long, {why}: a frame takes about {seconds:.2g} s of "
            f"one core and {format_bytes(plan.memory_bytes)} of memory"
        )
    return lines


def off_origin(target: Target, mesh: Mesh) -> Iterator[str]:
    """That a body from a file lies wholly beside its origin, as exports of assemblies do: it is not where it is put."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    middle = (low + high) / 2
    file = target.shape.plain
    if file is not None and ((low > 0.0) | (high < 0.0)).any():
        offset = [round(float(x), 3) + 0.0 for x in file.offset - middle / target.scale]
        yield (
            f"the mesh lies beside its origin, {np.linalg.norm(middle):.3g} m off: `motion` places and turns the "
            f"origin; `shape.offset: {offset}` brings the middle of the mesh there"
        )


def where_laws_hold(look: SampledScene) -> list[str]:
    """Where the law of each body of a scene holds or does not, one line at least a body."""
    lines: list[str] = []
    for target, law, body in zip(look.scene.world.targets, look.scene.laws, bodies(look), strict=True):
        low, high = body.ka
        notes = law.validity(body) or (f"holds, by size, facets and angles: ka {low:.3g} to {high:.3g} in the band",)
        lines += [f"{target.name}: {law.kind}: {line}" for line in notes]
    return lines


def bodies(look: SampledScene) -> list[Scatterer]:
    """The bodies of a scene as laws are asked about them."""
    sonar, speed = look.scene.sonar, look.profile.speed
    aperture, frames = elements(sonar.array).aperture, chosen(look)
    scatterers = []
    for number, mesh in enumerate(look.scene.meshes):
        distances, angles = [np.inf], [0.0]
        for frame in frames:
            centre, radius = sphere_round(frame.moment.bodies[number])
            away = frame.sonar_pose.position - centre
            distances.append(float(np.linalg.norm(away)) - radius)
            for snap in frame.moment.snaps:
                angles.append(_between(away, snap.position - centre))
        wavelengths = float(speed.min()) / sonar.band.high, float(speed.max()) / sonar.band.low
        scatterers.append(Scatterer(mesh, *wavelengths, min(distances), aperture, max(angles)))
    return scatterers


def _between(first: Floats, second: Floats) -> float:
    """Angle (rad) between two vectors (xyz); 0 where one has no length."""
    lengths = float(np.linalg.norm(first) * np.linalg.norm(second))
    return float(np.arccos(np.clip(first @ second / lengths, -1.0, 1.0))) if lengths > 0.0 else 0.0


def overlap_notes(look: SampledScene) -> list[str]:
    """Which bodies overlap, how, and in which frames."""
    when: dict[tuple[str, str, str], list[int]] = {}
    overlaps: dict[tuple[int, int, bytes], str | None] = {}
    frames = chosen(look)
    for frame in frames:
        for first, second in _near(frame):
            a, b = frame.moment.bodies[first], frame.moment.bodies[second]
            relative_pose = a.pose.to_body(b.pose.position), a.pose.turn_to_body(b.pose.turn_to_world(np.eye(3)))
            key = first, second, np.round(np.concatenate([relative_pose[0], relative_pose[1].ravel()]), 9).tobytes()
            if key not in overlaps:
                overlaps[key] = overlap(a, b)
            if kind := overlaps[key]:
                when.setdefault((a.name, b.name, kind), []).append(frame.index)
    return [
        f"{a} and {b} {kind} {said(indices, len(frames))}: surfaces inside the other body do not echo; surfaces that "
        "coincide echo once; visibility and labels treat each body as if it were alone"
        for (a, b, kind), indices in when.items()
    ]


def said(indices: Sequence[int], of: int) -> str:
    """Some frames out of so many, in words."""
    if len(indices) == of:
        return "in every frame" if of > 1 else f"in frame {indices[0]}"
    return f"in {len(indices)} of {of} frames examined (first: frame {indices[0]})"


def _near(frame: Frame) -> Iterator[tuple[int, int]]:
    """Pairs of bodies whose bounding spheres meet."""
    if len(frame.moment.bodies) < 2:
        return
    centre, radius = (np.array(column) for column in zip(*map(sphere_round, frame.moment.bodies), strict=True))
    for first in range(len(centre) - 1):
        apart = np.linalg.norm(centre[first + 1 :] - centre[first], axis=1)
        for second in np.flatnonzero(apart < radius[first] + radius[first + 1 :]).tolist():
            yield first, first + 1 + second


def view_notes(looks: Sequence[SampledScene]) -> list[str]:
    """That the beams look past all targets, in every frame of the looks: mostly a sonar without a heading."""
    examined = [(look, frame) for look in looks if look.scene.world.targets for frame in chosen(look)]
    if not examined or any(in_view(body, look, frame) for look, frame in examined for body in frame.moment.bodies):
        return []
    ahead = examined[0][1].sonar_pose.turn_to_world(np.array([1.0, 0.0, 0.0]))
    heading = round(float(np.rad2deg(np.arctan2(ahead[0], ahead[1])))) % 360
    return [
        f"no target is in the view of the beams in any frame examined: the sonar looks to {heading} deg (0 is north, "
        "90 east: the heading in scene.trajectory.sonar)"
    ]


def in_view(body: PlacedTarget, look: SampledScene, frame: Frame) -> bool:
    """Whether the box of a target is in the view of the beams, in part at least."""
    corners = frame.sonar_pose.to_body(body.box)
    return box_in_view(corners, BOX_FACES, look.scene.sonar.beams).view <= View.PARTLY_IN_VIEW


def hiding_notes(look: SampledScene) -> list[str]:
    """In which frames bodies hide all snaps from the array, on straight lines to its outermost hydrophones: it then has
    no clock."""
    frames, hidden, names = chosen(look), list[int](), set[str]()
    outermost = _outermost(elements(look.scene.sonar.array).position)
    for frame in frames:
        solid = [b for b, law in zip(frame.moment.bodies, look.scene.laws, strict=True) if not law.passes_sound]
        array = frame.sonar_pose.to_world(outermost)
        snaps = [snap.position for snap in frame.moment.snaps if snap.illuminates]
        lines = [[occluded((b,), alike(place, len(array)), array) for b in solid] for place in snaps]
        if lines and all(np.any(of_snap, axis=0).all() for of_snap in lines):
            hidden.append(frame.index)
            names |= {b.name for of_snap in lines for b, hides in zip(solid, of_snap, strict=True) if hides.any()}
    if not hidden:
        return []
    reflected = look.scene.physics.tracing.bounces > 0
    then = "a reflection may be taken for it" if reflected else "there is no clock, and there are no points"
    return [
        f"{', '.join(sorted(names))}: hides all snaps from the array {said(hidden, len(frames))}: no direct pulse is "
        f"heard to locate one by, so {then} (sound that goes round bodies is left out)"
    ]


def _outermost(position: Floats) -> Floats:
    """Those of hydrophones (sensor, xyz) that are farthest to each side, and to each corner."""
    ways = np.array([(y, z) for y in (-1, 0, 1) for z in (-1, 0, 1)])
    return np.asarray(position[np.unique((position[:, 1:] @ ways.T).argmax(axis=0))])


def mirror_notes(look: SampledScene) -> list[str]:
    """Which snaps and targets an array that cannot tell front from back hears as if in front, in which frames."""
    sonar = look.scene.sonar
    array = elements(sonar.array)
    normal = mirror_normal(array, float(look.profile.speed.min()) / sonar.band.high)
    if normal is None:
        return []
    frames = chosen(look)
    when: dict[str, list[int]] = {}
    snaps: list[int] = []
    for frame in frames:
        if any(float(frame.sonar_pose.to_body(snap.position) @ normal) < 0.0 for snap in frame.moment.snaps):
            snaps.append(frame.index)
        for target, body in zip(look.scene.world.targets, frame.moment.bodies, strict=True):
            corners = frame.sonar_pose.to_body(body.box)
            if (corners @ normal >= 0.0).all():
                continue
            behind = BOX_FACES[(corners @ normal)[BOX_FACES].min(axis=1) < 0.0]
            if box_in_view(mirror_image(corners, normal), behind, sonar.beams).view <= View.PARTLY_IN_VIEW:
                when.setdefault(target.name, []).append(frame.index)
    plane = "a planar array cannot tell its two sides apart"
    lines = []
    if snaps:
        lines = [
            f"snaps come from behind the array {said(snaps, len(frames))} and are taken for mirror images: {plane}"
        ]
    return lines + [
        f"{name}: behind the array {said(indices, len(frames))}, and its mirror image is within the beams: false "
        f"points appear in front of the array; {plane}"
        for name, indices in when.items()
    ]


def focus_notes(look: SampledScene) -> list[str]:
    """Which targets come so much nearer to the array than its focus, or farther, that each echo has several peaks."""
    sonar, focus = look.scene.sonar, look.scene.processing.beamforming.focus
    array, c = elements(sonar.array), sonar.assumed_sound_speed
    extent = np.sqrt(np.diag(aperture_moments(array))[1:])
    frames, lines = chosen(look), []
    for target, number in zip(look.scene.world.targets, range(len(look.scene.meshes)), strict=True):
        seen = [frame for frame in frames if in_view(frame.moment.bodies[number], look, frame)]
        away = np.array([_away(frame.moment.bodies[number], frame.sonar_pose.position) for frame in seen])
        curvature = 1.0 / away - (1.0 / focus if focus else 0.0)
        spread = defocus_spread(extent, curvature[:, None], 2.0 * np.pi * sonar.band.centre / c).max(
            axis=1, initial=0.0
        )
        if not spread.any():
            continue
        worst = int(np.argmax(spread))
        loss = _loss(look, float(away[worst]), float(spread[worst]))
        when = said([frame.index for frame, wide in zip(seen, spread, strict=True) if wide > 0.0], len(frames))
        lines.append(
            f"{target.name}: out of focus {when}: {away[worst]:.2g} m off, where beams are focused "
            f"{f'at {focus:.3g} m' if focus else 'for plane waves'}, an echo is {loss:.0f} dB fainter and several "
            f"points up to {min(float(np.rad2deg(spread[worst])), 180.0):.2g} deg beside it, as their predicted errors "
            "say (scene.processing.beamforming.focus)"
        )
    return lines


def _away(body: PlacedTarget, place: Floats) -> float:
    """Distance (m) of a place (xyz) in the world from the box round a body."""
    own = body.pose.to_body(place)
    return max(float(np.linalg.norm(own - np.clip(own, *body.mesh.box))), 1e-3)


def _loss(look: SampledScene, distance: float, spread: float) -> float:
    """Energy (dB) that the brightest beam about the axis, within an angle `spread` (rad), loses of a pulse that comes
    from there, so far away (m), by its focus."""
    sonar, focus = look.scene.sonar, look.scene.processing.beamforming.focus
    array, c = elements(sonar.array), sonar.assumed_sound_speed
    across, up = np.meshgrid(*2 * [np.linspace(-spread, spread, LOSS_BEAMS)])
    late = focus_delay(array.position, direction(0.0, 0.0), distance, c)
    late = late - focus_delay(array.position, direction(across.ravel(), up.ravel()), focus, c)
    samples = int(LOSS_BINS * sonar.sampling_frequency / (sonar.band.high - sonar.band.low))
    losses = []
    for waveform in extreme_waveforms(look.scene):
        f, spectrum = pulse_spectrum(waveform, sonar.antialias, sonar.sampling_frequency, samples)
        band = (f >= sonar.band.low) & (f <= sonar.band.high)
        power = np.abs(spectrum[band]) ** 2 + 1e-300
        brightness = sum(
            p * np.abs(np.exp(2j * np.pi * frequency * late) @ live_gain(array.gain)) ** 2
            for frequency, p in zip(f[band], power / power.sum(), strict=True)
        )
        losses.append(-10.0 * float(np.log10(np.max(brightness))))
    return max(losses, default=0.0)
