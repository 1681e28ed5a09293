"""What is far off in space or time, and what touches a target: the same numbers, or one line that names the field."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sonarsynth as ss
from sonarsynth.geometry.motion import Circle
from sonarsynth.validation.references.frames.moving_points import Mover

TANK = Path(__file__).resolve().parents[2] / "configs" / "tank.yaml"
AT, AHEAD = (20.0, 1.0, -19.0), (1.5, -2.0, 0.1)  # m, m/s
SNAP, SONAR = "scene.world.sources.0", "scene.trajectory.sonar"


def crate(*sets: str, position: tuple[float, ...] = AT, motion: str = "") -> ss.Recipe:
    """A crate 20 m ahead of a small array that looks east, and a shrimp in mid-water."""
    motion = motion or f"{{kind: still, position: {list(position)}}}"
    return ss.load(
        TANK,
        [
            "scene.world.environment={depth: 40 m, sound_speed: {kind: isovelocity, speed: 1500 m/s}}",
            "scene.world.targets.0.shape={kind: box, size: [1 m, 1 m, 1 m], edge: 20 cm}",
            f"scene.world.targets.0.motion={motion}",
            f"{SNAP}={{kind: snapping_shrimp, position: [12, -6, -22]}}",
            "scene.sonar.array={kind: planar_lattice, columns: 8, rows: 6, pitch: 5 cm}",
            "scene.sonar.assumed_sound_speed=1500 m/s",
            f"{SONAR}={{kind: still, position: [0, 0, -20], heading: 90 deg}}",
            "scene.sonar.beams.azimuths=11",
            "scene.sonar.beams.elevations=11",
            "rays=null",
            *sets,
        ],
    )


def same(one: ss.Recipe, other: ss.Recipe, error: float = 1e-6) -> None:
    """Signals, what is located and the cloud agree."""
    a, b = (ss.render(recipe, 0) for recipe in (one, other))
    peak = np.abs(a["signals/pressure"].values).max()
    assert np.abs(a["signals/pressure"].values - b["signals/pressure"].values).max() <= error * peak > 0.0
    assert int(a["source_estimates/reason"][0]) == 0 and int(a["cloud/count"]) > 0
    for name in ("signals/start", "source_estimates/time", "source_estimates/position"):
        largest = np.nanmax(np.abs(a[name].values))
        np.testing.assert_allclose(a[name].values, b[name].values, rtol=0.0, atol=2e-6 * largest, err_msg=name)
    for name in ("cloud/range", "cloud/azimuth"):  # beams of 4 degrees: of these the rounding of signals moves peaks
        late = np.abs(a[name].values - b[name].values) / a[f"{name}_error"].values
        assert np.nanmax(late) < 1e-5 and (np.isnan(a[name].values) == np.isnan(b[name].values)).all(), name


@pytest.mark.parametrize("away", [(1e4, 0.0), (9e5, -9e5)])
def test_a_scene_that_is_moved_by_1000_km_has_the_same_numbers(away: tuple[float, float]) -> None:
    x, y = away
    near = crate(position=(20.0, -1.5, -19.0))
    moved = crate(
        f"{SNAP}.position={[12.0 + x, -6.0 + y, -22.0]}",
        f"{SONAR}.position={[x, y, -20.0]}",
        position=(20.0 + x, -1.5 + y, -19.0),
    )
    same(near, moved)


def passing(clock: float) -> ss.Recipe:
    """The crate goes by; the motions began so long ago (s)."""
    way = [
        f"{{time: {clock + side} s, position: {[p + v * side for p, v in zip(AT, AHEAD, strict=True)]}}}"
        for side in (-8.0, 8.0)
    ]
    motion = f"{{kind: waypoints, points: [{', '.join(way)}]}}"
    return crate(f"scene.trajectory.start={clock!r} s", motion=motion)


@pytest.mark.parametrize("clock", [1e6, 1e9])
def test_a_scene_that_has_gone_on_for_thirty_years_has_the_same_numbers(clock: float) -> None:
    same(passing(0.0), passing(clock))


REFUSED = {
    "a source on a face": (crate(f"{SNAP}.position=[19.5, 1, -19]"), f"{SNAP}.position: is inside target 'cylinder'"),
    "a source on the far face": (crate(f"{SNAP}.position=[20.5, 1, -19]"), f"{SNAP}.position: is inside target"),
    "a hydrophone in a target": (
        crate(position=(0.0, 0.65, -20.0)),
        "scene.world.targets.0.motion: target 'cylinder' contains hydrophone 0 at frame 0, or touches it",
    ),
    "a hydrophone on a target": (
        crate(position=(0.5, 0.0, -20.0)),
        "scene.world.targets.0.motion: target 'cylinder' contains the sonar at frame 0, or touches it",
    ),
    "a snap a year late": (crate(f"{SNAP}.snap_times=[3e7 s]"), f"{SNAP}.snap_times: 3e+07 s is more than 1e+06 s"),
    "a clock of 30 000 years": (crate("scene.trajectory.start=1e12 s"), "scene.trajectory: frame 0 is 1e+12 s from"),
}


@pytest.mark.parametrize("which", REFUSED)
def test_what_would_be_silent_or_without_digits_is_refused_in_one_line(which: str) -> None:
    recipe, line = REFUSED[which]
    with pytest.raises(ss.FieldError) as refused:
        ss.plan(recipe)
    assert str(refused.value).startswith(line)
    assert "\n" not in str(refused.value)


def test_a_source_a_hair_off_a_face_is_heard() -> None:
    """What is refused is no more than what touches."""
    frame = ss.render(ss.plan(crate(f"{SNAP}.position=[19.499998, 1, -19]"), ["signals"]), 0)
    r = np.linalg.norm([19.499998, 1.0, 1.0])
    assert float(frame["link_budget"]["source_level"].values.ravel()[0]) > 0.0
    assert np.abs(frame["signals/pressure"].values).max() > 1e3 / r


@pytest.mark.parametrize(
    ("depths", "said"), [([0, 18, 18, 40], True), ([0, 18, 18.01, 40], True), ([0, 10, 30, 40], False)]
)
def test_a_sound_speed_that_jumps_is_said_to_be_beyond_rays(depths: list[float], said: bool) -> None:
    water = f"{{kind: tabulated, depth: {depths}, speed: [1520, 1520, 1480, 1480]}}"
    notes = ss.plan(crate(f"scene.world.environment.sound_speed={water}"), ["signals"]).validity
    assert any("by 40 m/s within a wavelength of 25000 Hz at 18 m" in note for note in notes) == said


def fold(phase: float) -> float:
    """Modulus of int exp(i (t^3/3 - z t)) dt over that of its two stationary points, as rays have it, z such that
    these are so much (rad) apart: the waves of a fold, by quadrature along a line where the integrand dies away."""
    z = (0.75 * phase) ** (2.0 / 3.0)
    u, step = np.linspace(-12.0, 12.0, 200_001, retstep=True)
    t = u + 0.5j
    rays = 2.0 * np.sqrt(np.pi) * z**-0.25 * np.cos(0.5 * phase - 0.25 * np.pi)
    return float(np.abs(np.exp(1j * (t**3 / 3.0 - z * t)).sum() * step) / rays)


@pytest.mark.parametrize("away", [228.15, 228.5, 229.0, 240.0])
def test_rays_beside_the_caustic_at_which_they_meet_are_said_to_be_too_loud(away: float) -> None:
    water = "{kind: tabulated, depth: [0, 20, 40], speed: [1520, 1490, 1520]}"
    recipe = crate(
        f"scene.world.environment.sound_speed={water}", f"{SNAP}.position=[{away}, 0, -18]", f"{SONAR}.position.2=-24"
    )
    plan, (start, end) = ss.plan(recipe, ["signals"]), ((away, 0.0, -18.0), (0.0, 0.0, -24.0))
    rays = ss.eigenrays_between(recipe.scene.world.environment.sound_speed, 40.0, start, end, vertices=1)
    turned = rays.travel_time[(rays.surface + rays.bottom == 0) & (rays.turning == 1)]
    phase = 2.0 * np.pi * recipe.scene.sonar.band.low * float(np.diff(turned).min())
    said = [note for note in plan.validity if "caustic" in note]
    assert bool(said) == (phase < 1.0)
    for note in said:
        louder = float(note.partition("they are ")[2].split()[0])
        assert louder == pytest.approx(-20.0 * np.log10(fold(phase)), abs=0.02 * louder + 0.05)


def test_points_of_what_turns_may_be_none() -> None:
    mover = Mover(Circle(centre=(22.0, 3.0, -29.0), radius=4.0, speed=1.4), 0.3)
    assert mover.points(np.empty((0, 3)), np.empty(0)).shape == (0, 3)
    assert mover.velocity(np.empty((0, 3)), np.empty(0)).shape == (0, 3)


@pytest.mark.parametrize(("bounces", "begin"), [(1, 0.0443), (2, 0.0683)])
def test_echoes_of_a_snap_on_a_hardly_rough_bottom_are_those_of_a_smooth_one(bounces: int, begin: float) -> None:
    """Its image, which lies where it does, counts as no reflection, whether it comes blurred or not; begin (s): of the
    echoes by so many reflections, of which none is the image's."""
    smooth, rough = (
        ss.render(
            ss.plan(
                crate(
                    f"{SNAP}={{kind: snapping_shrimp, position: [12, -6]}}",
                    f"scene.world.environment.bottom.rms_height={height} m",
                    f"scene.physics.tracing={{kind: auto, bounces: {bounces}}}",
                ),
                ["signals"],
            ),
            0,
        )
        for height in (0.0, 1e-9)
    )
    first = round((begin - float(smooth["signals/start"])) * 196e3)
    echo = slice(first, first + round(3e-3 * 196e3))
    a, b = (frame["signals/pressure"].values[:, echo] for frame in (smooth, rough))
    assert np.abs(a - b).max() < 2e-3 * np.abs(a).max() > 0.0
