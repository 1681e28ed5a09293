"""Formulas of the environment that a scene uses outside their range: one line each, with the field, said once.

Frames use the same formulas without a word.
"""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import evenly
from sonarsynth.description import FieldError
from sonarsynth.environment.absorption import absorption_notes
from sonarsynth.environment.boundary_numbers import boundary_notes
from sonarsynth.environment.down_cast import PLAUSIBLE
from sonarsynth.environment.sea import Profile
from sonarsynth.equations.water.boundary_reflection import plane_wave_error
from sonarsynth.planning.measured.ray_bending import ways
from sonarsynth.planning.measured.sampled_frames import SampledScene
from sonarsynth.planning.notes.noise_checks import noise_notes
from sonarsynth.planning.plan_tables import Omission
from sonarsynth.planning.plans import Plan
from sonarsynth.recipe.scene import Scene


def validity(look: SampledScene) -> tuple[str, ...]:
    """Notes on the environment of a scene, over its depths and the band of its sonar.

    Raises FieldError where the sound speed that the sonar believes in cannot be read.
    """
    scene, profile = look.scene, look.profile
    environment, band = scene.world.environment, scene.sonar.band
    field_notes = [("sound_speed", note) for note in (*profile.notes, *_of_no_water(profile, environment.depth))]
    if scene.physics.tracing.layered:
        field_notes += [("sound_speed", note) for note in (*_steps(profile, band.low), *_caustics(look))]
    field_notes += [
        ("absorption", note)
        for note in absorption_notes(environment.absorption, [[band.low], [band.high]], [0.0, environment.depth])
    ]
    chorus, described = scene.world.chorus, scene.world.reverberation
    for name, boundary in (("surface", environment.surface), ("bottom", environment.bottom)):
        of_sea = chorus is not None or (described is not None and (described.bounces or name in described.owners))
        if scene.physics.tracing.bounces or of_sea:
            field_notes += [(f"{name}.{field}", note) for field, note in boundary_notes(boundary, band.low, band.high)]
    lines = [f"scene.world.environment.{field}: {note}" for field, note in field_notes]
    laws = {} if described is None else {"bottom": described.bottom, "surface": described.surface}
    for name, law in laws.items():
        lines += [f"scene.world.reverberation.{name}: {note}" for note in (() if law is None else law.notes())]
    return (*lines, *noise_notes(scene), *(f"{'.'.join(BELIEVED)}: {note}" for note in _believed(scene)))


def _of_no_water(profile: Profile, depth: float) -> list[str]:
    """Whether the sound speed above the bottom is one that no sea has, as where its unit is wrong."""
    low, high, unit = PLAUSIBLE["sound speed"]
    speeds = profile.at(np.append(profile.depth[profile.depth < depth], depth))
    odd = speeds[(speeds < low) | (speeds > high)]
    return [f"{odd[0]:.4g} {unit} is of no water: its sound speed is {low:g} to {high:g} {unit}"] if len(odd) else []


STEP = 2.0
"""m/s: a change of the sound speed within a wavelength that is said: it reflects what grazes it by 3 degrees."""


def _steps(profile: Profile, frequency: float) -> list[str]:
    """Whether the sound speed changes so much within a wavelength (at a frequency, Hz) that rays do not tell how."""
    wavelength = float(profile.speed.min()) / frequency
    above, below = (profile.at(profile.depth + side * wavelength) for side in (-0.5, 0.5))
    change = np.abs(below - above)
    at = int(np.argmax(change))
    if profile.uniform or change[at] <= STEP:
        return []
    grazing = np.rad2deg(np.arccos(min(above[at], below[at]) / max(above[at], below[at])))
    return [
        f"changes by {change[at]:.2g} m/s within a wavelength of {frequency:g} Hz at {profile.depth[at]:.4g} m: waves "
        f"that meet it at less than {grazing:.1f} deg are reflected there with a phase up to 90 deg off, and what it "
        "reflects of others is left out"
    ]


FOLD, RAYS = 1.0, 200
"""rad: rays that meet at a caustic are noted where less apart (0.7 dB too loud); ways on which they are looked for."""


def _caustics(look: SampledScene) -> list[str]:
    """Whether rays, in the first frame, are so near the caustic at which they meet that their level is wrong.

    Two rays of amplitude A, the later by d of phase, add to 2 A cos(d/2 - pi/4), and what waves there have is
    2 A sqrt(pi) z^(1/4) Ai(-z), z = (3 d/4)^(2/3): Brekhovskikh and Lysanov (2003), section 2.6.
    """
    from scipy.special import airy

    scene, frame, bottom = look.scene, look.frames[0], look.scene.world.environment.depth
    start, end = ways(frame, bottom)
    if look.profile.uniform or not len(start):
        return []
    some = evenly(len(start), RAYS)
    paths = scene.physics.tracing.connect(look.profile, bottom, start[some], end[some])
    order = np.lexsort((paths.travel_time, paths.bottom, paths.surface, paths.pair))
    columns = (paths.pair, paths.surface, paths.bottom, paths.caustics)
    *apart, passed = (np.diff(column[order]) for column in columns)
    late = 2.0 * np.pi * scene.sonar.band.low * np.diff(paths.travel_time[order])
    fold = ~np.any(apart, axis=0) & (passed != 0) & (late < FOLD)
    if not fold.any():
        return []
    d = max(float(late[fold].min()), 1e-12)
    z = (0.75 * d) ** (2.0 / 3.0)
    over = 20.0 * np.log10(np.cos(0.5 * d - 0.25 * np.pi) / (np.sqrt(np.pi) * z**0.25 * airy(-z)[0]))
    return [
        f"in frame {frame.index} two rays are {1e6 * d / (2.0 * np.pi * scene.sonar.band.low):.2g} us apart beside the "
        f"caustic at which they meet: at {scene.sonar.band.low:g} Hz they are {over:.2g} dB louder than waves there, "
        "and silent beyond, where waves are not"
    ]


BELIEVED = ("scene", "processing", "placing", "profile")


def _believed(scene: Scene) -> tuple[str, ...]:
    """Notes on the sound speed that the sonar ranges with."""
    try:
        return scene.processing.placing.notes()
    except (ValueError, OSError, ImportError) as error:
        raise FieldError(BELIEVED, str(error)) from None


def curved_waves(plan: Plan) -> list[Omission]:
    """What is left out by reflecting waves at a fast bottom as if they were plane, in the first frame."""
    frame = plan.recipe.frame(plan.recipe.first_frame(plan.sequence))[1]
    fluid, depth = plan.scene.world.environment.bottom.reflection.fluid, plan.medium.depth
    ratio = 1.0 if fluid is None else fluid[1]
    if not plan.propagation.bounces or ratio <= 1.0 or not frame.moment.snaps:
        return []
    array = frame.sonar_pose.position
    images = [snap.position * [1.0, 1.0, -1.0] - [0.0, 0.0, 2.0 * depth] for snap in frame.moment.snaps]
    shortest = min(float(np.linalg.norm(image - array)) for image in images)
    wavenumber = 2.0 * np.pi * plan.scene.sonar.band.low / float(plan.profile.at(depth))
    error, critical = float(plane_wave_error(shortest, wavenumber)), np.rad2deg(np.arccos(1.0 / ratio))
    bound = f"up to {error:.1g} of a wave that meets it within a few degrees of its critical angle, {critical:.0f} deg"
    return [Omission("curvature of waves at the bottom", "they are reflected as plane waves", bound)]
