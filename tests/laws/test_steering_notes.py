"""What plans say of images of a sonar that moves: how far off echoes are heard, against times at each sensor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from sonarsynth.planning.measured.sampled_frames import sample_frames
from sonarsynth.planning.notes.source_notes import steering_error, steering_notes
from sonarsynth.recipe import reading

FAR, SPEED = 1e5, 1500.0
REMUS = Path(__file__).parents[2] / "configs" / "remus.yaml"


@pytest.mark.parametrize("velocity", [(12.0, 0.0, 0.0), (-12.0, 0.0, 0.0), (0.0, 9.0, 0.0), (5.0, -7.0, 3.0)])
@pytest.mark.parametrize("azimuth", [0.0, 0.4, -1.2])
def test_a_front_passes_the_sensors_of_a_moving_array_as_one_from_where_it_is_heard(azimuth, velocity) -> None:
    """Each time is solved by itself; the slope of the times over the array is the direction that beams find."""
    sensors = np.random.default_rng(4).uniform(-0.5, 0.5, (40, 3)) * (0.0, 1.0, 1.0)
    towards = np.array([np.cos(azimuth) * np.cos(0.2), np.sin(azimuth) * np.cos(0.2), np.sin(0.2)])

    def late(time: float, sensor: np.ndarray) -> float:
        return float(np.linalg.norm(FAR * towards - sensor - np.array(velocity) * time) - FAR - SPEED * time)

    times = [brentq(late, -0.1, 0.1, args=(sensor,), xtol=1e-15) for sensor in sensors]
    slope = np.linalg.lstsq(np.column_stack([np.ones(40), sensors[:, 1:]]), np.array(times), rcond=None)[0][1:]
    from_axis = np.arccos(towards[0])
    off = np.arcsin(SPEED * np.linalg.norm(slope)) - from_axis
    approach = float(np.dot(towards, velocity)) / SPEED
    assert off == pytest.approx(float(steering_error(from_axis, np.asarray(approach))), abs=1e-6)
    assert abs(off) > 1e-4 or approach == 0.0


def test_what_is_off_by_a_part_of_a_beam_is_said() -> None:
    """At 10 m/s 0.2 degrees in the corners of remus.yaml; at 3 m/s less than a quarter of a beam; at rest nothing."""

    def lines(speed: float) -> list[str]:
        course = f"scene.trajectory.sonar={{kind: course, start: [0, 0, -5], heading: 90 deg, speed: {speed} m/s}}"
        return steering_notes(sample_frames(reading.load(REMUS, [course, "scene.trajectory.frames=2"])))

    (line,) = lines(10.0)
    expected = np.rad2deg(
        abs(float(steering_error(np.arccos(np.cos(np.deg2rad(25)) ** 2), np.cos(np.deg2rad(25)) ** 2 / 154.0)))
    )
    assert f"at 10 m/s echoes at their edges appear {expected:.2g} deg off where they come from" in line
    assert lines(3.0) == [] and lines(0.0) == []
