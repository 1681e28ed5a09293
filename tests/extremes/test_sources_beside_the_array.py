"""A source at the array, or among its hydrophones: a line that names the field, or a right result; never silence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sonarsynth as ss
from sonarsynth.conventions import azimuth_elevation, direction
from sonarsynth.environment.sea import Profile
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.ranging import SensorDelays
from sonarsynth.ranging.location.triggered import Triggered
from sonarsynth.receiver import PlanarLattice, Romanis, Sonar, elements
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.state import Emission, Receiver, Survey
from tests.heard import envelope_late, hear_direct, silence

TANK = Path(__file__).resolve().parents[2] / "configs" / "tank.yaml"
FEW = ["scene.sonar.beams.azimuths=11", "scene.sonar.beams.elevations=11"]


def tank(x: float, y: float, z: float, *sets: str) -> ss.Recipe:
    """The tank, its sonar at (0, 0, -0.15) with hydrophones 1 cm from each other, and its shrimp elsewhere."""
    return ss.load(TANK, [f"scene.world.sources.0.position={[x, y, z]}", *FEW, *sets])


@pytest.mark.parametrize(
    ("position", "line"),
    [
        ((0.0, 0.0, -0.15), "is at the centre of the array at frame 0"),
        ((0.0, 0.005, -0.155), r"is at hydrophone \d+ of the array at frame 0"),
        ((0.0, 0.0052, -0.155), r"is at hydrophone \d+ of the array at frame 0"),
        (
            (0.0, 0.002, -0.15),
            r"is 0.002 m from the centre of the array at frame 0, among its hydrophones, which reach",
        ),
        ((0.03, 0.01, -0.15), r"is 0.0316 m from the centre .* no image without its position"),
    ],
)
def test_a_source_at_the_array_is_refused_in_one_line(position: tuple[float, float, float], line: str) -> None:
    with pytest.raises(ss.FieldError, match=rf"scene\.world\.sources\.0\.position: {line}") as refused:
        ss.plan(tank(*position))
    assert "\n" not in str(refused.value)


def test_among_the_hydrophones_its_signals_alone_are_right() -> None:
    """As if each hydrophone were traced by itself."""
    array = "scene.sonar.array={kind: planar_lattice, columns: 6, rows: 4, pitch: 2 cm}"
    near, exact = (
        ss.render(ss.plan(tank(0.02, 0.01, -0.15, array, *how), products=["signals"]), 0)["signals/pressure"].values
        for how in ((), ("scene.physics.subarrays=sensors",))
    )
    assert np.isfinite(near).all() and np.abs(near).max() > 1e3
    assert np.linalg.norm(near - exact) < 2e-3 * np.linalg.norm(exact)


def test_beside_the_hydrophones_it_is_located_and_imaged() -> None:
    beside = ss.render(tank(0.1, 0.0, -0.15), 0)
    assert np.isfinite(beside["image/energy"].values).all()
    assert float(beside["source_estimates/time"][0]) == pytest.approx(
        float(beside["truth/emissions/arrival"][0]), abs=1e-7
    )


def test_among_the_hydrophones_its_trigger_tells_when_and_where() -> None:
    """A ping: its time and place are known, so that it need not be located; its echoes come from the target."""
    told = "scene.processing.locating={kind: trigger, time_error: 1e-9 s, position_error: 1e-6 m}"
    ping = ss.render(tank(0.03, 0.01, -0.15, told), 0)
    found, cloud = ping["source_estimates"], ping["cloud"]
    assert float(found["time"][0]) == pytest.approx(float(ping["truth/emissions/arrival"][0]), abs=1e-7)
    np.testing.assert_allclose(found["position"][0], [0.03, 0.01, 0.0], atol=1e-5)  # in the frame of the sonar
    assert int(found["emission"][0]) == 0 and np.isfinite(ping["image/energy"].values).all()
    count = int(cloud["count"])
    assert count > 0 and (cloud["target"].values[:count] == 0).all()
    assert cloud["distance"].values[:count].max() < 0.005


def test_a_trigger_errs_as_it_says() -> None:
    method, random = Triggered(time_error=3e-6, position_error=0.02), np.random.default_rng(3)
    receiver = Receiver(Pose(np.array([0.0, 0.0, -5.0]), quaternion(0.5 * np.pi)), elements(Romanis()))
    snap = Emission(np.array([1.0, 0.5, -4.0]), 0.25, LogarithmicBubble(), None)
    told = [method.told((snap,), receiver, random)[0] for _ in range(400)]
    off = np.array([(t.position - snap.position) / 0.02 for t in told])
    late = np.array([t.time for t in told]) - 0.25
    assert np.std(off) == pytest.approx(1.0, abs=0.08) and abs(np.mean(off)) < 0.1
    assert np.std(late) == pytest.approx(3e-6, rel=0.15) and abs(late.mean()) < 1e-5
    survey = Survey(10.0, Profile(np.array([0.0]), np.array([1540.0])), (told[0],))
    found = method.locate(silence(receiver.elements, 0.0, 0), receiver, survey, 2)
    assert found.reason.tolist() == [0, 1] and np.isnan(found.time[1])
    np.testing.assert_allclose(receiver.pose.to_world(found.position[0]), told[0].position, atol=1e-12)
    assert found.time_error[0] > 3e-6


@pytest.mark.parametrize(
    ("low", "high", "lattice", "position"),
    [
        (60.0, 63.0, "columns: 8, rows: 4, pitch: 17.5 mm", (0.47, -0.23, -14.0)),  # long pulses along the array
        (25.0, 85.0, "columns: 2, rows: 8, pitch: 42 mm", (12.1, 2.4, -34.0)),  # faces have a null in the band
        (1.0, 3.4, "columns: 8, rows: 8, pitch: 47 cm", (20.0, -16.0, -68.0)),  # both
        (5.0, 17.0, "columns: 16, rows: 4, pitch: 42 mm", (3.2, 2.6, 39.0)),
    ],
)
def test_a_source_far_off_the_axis_errs_as_it_says(
    low: float, high: float, lattice: str, position: tuple[float, float, float]
) -> None:
    """Without noise, where only the cutting of pulses errs; time within 40 ns, 1 % of what it was."""
    x, y, z = position
    recipe = ss.load(
        TANK,
        [
            "scene.world.environment={depth: 200 m, sound_speed: {kind: isovelocity, speed: 1540 m/s}}",
            "scene.world.targets=[]",
            f"scene.world.sources.0={{kind: snapping_shrimp, position: {[x, y, z - 100.0]}}}",
            f"scene.sonar.array={{kind: planar_lattice, {lattice}}}",
            f"scene.sonar.band={{low: {low} kHz, high: {high} kHz}}",
            "scene.sonar.assumed_sound_speed=1540 m/s",
            "scene.trajectory.sonar={kind: still, position: [0, 0, -100], heading: 90 deg}",
            "rays=null",
            *FEW,
        ],
    )
    frame = ss.render(recipe, 0)
    found, true = frame["source_estimates"], frame["truth/emissions"]
    assert int(found["reason"][0]) == 0
    for name, told in (("time", "arrival"), ("azimuth", "azimuth"), ("elevation", "elevation")):
        assert abs(float(found[name][0] - true[told][0])) < 4.0 * float(found[f"{name}_error"][0])
    assert abs(float(found["time"][0] - true["arrival"][0])) < 4e-8


@pytest.mark.parametrize("noise", [0.0, 1e-3])
@pytest.mark.parametrize("array", [Romanis(), PlanarLattice(columns=12, rows=12, pitch=0.1, face=0.04953)])
def test_a_source_near_and_off_the_axis_is_where_it_is_predicted(array: Romanis | PlanarLattice, noise: float) -> None:
    """Nearer than 2 m, where hydrophones hear it through nulls of their faces, each through another: cut by the window
    of a snap alone, its tails bend the wavefront, by 7 predicted errors (2 in the root mean square) and 0.2 mm."""
    random, rows, c = np.random.default_rng(3), [], 1540.0
    heard, sonar = elements(array), Sonar(array=array, assumed_sound_speed=c, sound_speed_error=0.0)
    receiver = Receiver(Pose(np.array([0.0, 0.0, -40.0]), quaternion(0.5 * np.pi)), heard, sonar)
    for _ in range(24):
        source = random.uniform(1.05, 2.0) * direction(random.uniform(-0.9, 0.9), random.uniform(-0.6, 0.6))
        signals = hear_direct(heard, source, noise=noise, random=random)
        water = Survey(100.0, Profile(np.array([0.0]), np.array([c])))
        found = SensorDelays(on_bottom=False).locate(signals, receiver, water, 1)
        azimuth, elevation = azimuth_elevation(source)
        off = found.position[0] - source
        late = found.time[0] - np.linalg.norm(source) / c - envelope_late()
        rows.append([
            (found.azimuth[0] - azimuth) / found.azimuth_error[0],
            (found.elevation[0] - elevation) / found.elevation_error[0],
            late / found.time_error[0],
            np.sqrt(off @ np.linalg.solve(found.position_covariance[0], off) / 3.0),
        ])  # fmt: skip
        assert np.linalg.norm(off) < 2e-5 and abs(late) < 1e-8
    pulls = np.abs(rows)
    assert pulls.max() < 4.0 and (np.sqrt(np.mean(pulls**2, axis=0)) < 1.2).all(), pulls
