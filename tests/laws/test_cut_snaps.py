"""Snaps that an end of the record cuts off at some sensors, or at most of them, are located by those that hear all of
it, or refused, and never at a place that they did not come from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import sonarsynth as ss
from sonarsynth.environment.sea import Profile
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.products import REASONS, Signals, SourceEstimates
from sonarsynth.ranging import SensorDelays
from sonarsynth.receiver import PlanarLattice, Romanis, Sonar, elements
from sonarsynth.state import Receiver, Survey
from tests.heard import RATE, envelope_late, hear, hear_direct

C, SOURCE = 1540.0, np.array([9.0, 6.0, -5.0])
POSE, WATER = Pose(np.array([0.0, 0.0, -5.0]), quaternion(np.pi / 2)), Profile(np.array([0.0]), np.array([C]))
ACCEPTED, CUT = REASONS.index("accepted"), REASONS.index("cut_off")
ARRAYS = Romanis(), PlanarLattice(columns=24, rows=24, pitch=0.04), PlanarLattice(columns=10, rows=10, pitch=0.06)


def located(signals: Signals, array: Romanis | PlanarLattice, snaps: int = 1) -> SourceEstimates:
    receiver = Receiver(POSE, elements(array), Sonar(array=array, assumed_sound_speed=C))
    return SensorDelays().locate(signals, receiver, Survey(10.0, WATER), snaps)


def cut(signals: Signals, samples: int, *, first: bool) -> Signals:
    """Of which so many samples are before the array centre hears the snap, and none earlier, or `first` is false: so
    many are after that, and none later."""
    middle = round((float(np.linalg.norm(SOURCE)) / C - signals.start) * RATE)
    begin, stop = (middle - samples, None) if first else (0, middle + samples)
    some = np.ascontiguousarray(signals.pressure[:, begin:stop])
    return replace(signals, pressure=some, start=signals.start + begin / RATE)


@pytest.mark.parametrize("array", ARRAYS, ids=["508", "576", "100"])
@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize("samples", [0, 10, 20, 40, 60, 100])
def test_a_snap_at_an_end_of_the_record_is_where_it_is_predicted_or_refused(array, first, samples) -> None:
    """In random scenes it was put by 1.7 m beside its place, which is 25 predicted errors, where half of the array
    heard half of it, and by 7 mm where a third heard none."""
    found = located(cut(hear_direct(elements(array), SOURCE), samples, first=first), array)
    if samples < 30:
        assert found.reason[0] != ACCEPTED and np.isnan(found.position).all()
        return
    off = found.position[0] - SOURCE
    assert found.reason[0] == ACCEPTED and np.linalg.norm(off) < 2e-3
    assert off @ np.linalg.pinv(found.position_covariance[0]) @ off < 3.0 * 3.0**2


def test_what_the_record_cuts_off_is_named() -> None:
    found = located(cut(hear_direct(elements(Romanis()), SOURCE), 0, first=True), Romanis())
    assert found.reason.tolist() == [CUT]


def test_a_record_that_has_all_of_a_snap_changes_nothing() -> None:
    """Of 100 sensors it lasts 0.9 ms from the first to the last of them, 0.16 ms before and after it included."""
    whole = hear_direct(elements(ARRAYS[2]), SOURCE)
    ours, theirs = (located(signals, ARRAYS[2]) for signals in (whole, cut(whole, 120, first=True)))
    assert np.linalg.norm(ours.position[0] - theirs.position[0]) < 1e-6


@pytest.mark.parametrize("later", [1.9e-3, 2.5e-3])
def test_what_comes_before_a_snap_is_no_other_snap(later: float) -> None:
    """Without noise, at 94 dB below it: as far as synthetic signals are exact. It would be a snap at the same place."""
    array = elements(ARRAYS[2])
    signals = hear_direct(array, SOURCE, samples=2400)
    signals = hear(signals, array, SOURCE, -later, 2e-5)
    found = located(signals, ARRAYS[2], 3)
    assert (found.reason == ACCEPTED).sum() == 1
    assert abs(found.time[0] - np.linalg.norm(SOURCE) / C - envelope_late()) < 1e-8


def test_a_snap_is_ahead_of_an_array_that_cannot_tell_its_sides_apart() -> None:
    """Also where a fit to the flank of its pulse, which begins slowly, has looked behind: it was found once more there,
    16.6 m off, which is 11 000 predicted errors, and the snap taken for an echo of that."""
    recipe = ss.load("configs/remus.yaml", [
        "scene.world.targets=[]",
        "scene.world.sources.0.position=[8.29477782, 3.52668745]",
        "scene.world.sources.0.snap={kind: keller_miksis, gas_pressure: 10 kPa, rebounds: 3}",
        "scene.sonar.array={kind: planar_lattice, columns: 6, rows: 6, pitch: 1.848 cm}",
        "scene.sonar.converter=null",
        "scene.sonar.beams={azimuths: 3, elevations: 3}",
        "scene.processing.locating={kind: sensor_delays, on_bottom: false}",
    ])  # fmt: skip
    found = ss.render(recipe, 32)["source_estimates"]
    off = found["position"].values[0] - [8.29477782, 3.52668745, -5.0]
    assert np.linalg.norm(off) < 2e-3 and int(found["emission"][0]) == 0
