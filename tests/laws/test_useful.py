"""What verify says of data that are as good as they claim, and of no use, and of data that are not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

from sonarsynth.evaluation import bounds, range_errors
from sonarsynth.products import ORIGINS

BEAMS = (4, 100)


def tree(
    error: float = 0.02,
    predicted: float = 0.02,
    snap_error: float = 0.1,
    snap_predicted: float = 0.1,
    **labels: Any,
) -> xr.DataTree:
    """A store of four frames: a point in each of 100 beams 20 m away, on a target of 2 m, and a snap 15 m away."""
    random = np.random.default_rng(0)
    columns = {
        "range": 20.0 + error * random.normal(size=BEAMS),
        "range_error": np.full(BEAMS, predicted),
        "true_range": np.full(BEAMS, 20.0),
        **{name: np.zeros(BEAMS, np.int16) for name in ("target", "emission", "family", "lit_by", "origin")},
    }
    for name, (count, value) in labels.items():
        columns[name][:, :count] = value
    rows = np.arange(4.0)[:, None, None]
    truth = {
        "sonar_position": (("frame", "xyz"), np.zeros((4, 3))),
        "sonar_orientation": (("frame", "wxyz"), np.tile([1.0, 0, 0, 0], (4, 1))),
    }
    corners = np.tile(np.linspace(-0.577, 0.577, 8)[:, None], (4, 1, 1, 3))
    targets = {"box": (("frame", "target", "corner", "xyz"), corners)}
    emitted = {
        **{name: (("frame", "emission"), np.zeros((4, 1))) for name in ("arrival", "azimuth", "elevation")},
        "position": (("frame", "emission", "xyz"), np.tile([[[15.0, 0, 0]]], (4, 1, 1))),
    }
    estimates = {
        "position": (("frame", "estimate", "xyz"), 15.0 * np.array([[[1.0, 0, 0]]]) + snap_error * (1 + 0 * rows)),
        "position_covariance": (
            ("frame", "estimate", "xyz", "xyz_other"),
            np.tile(snap_predicted**2 * np.eye(3) / 3.0, (4, 1, 1, 1)),
        ),
        **{name: (("frame", "estimate"), np.zeros((4, 1), np.int16)) for name in ("emission", "reason")},
        **{name: (("frame", "estimate"), np.zeros((4, 1))) for name in ("time", "azimuth", "elevation")},
        **{
            f"{name}_error": (("frame", "estimate"), np.full((4, 1), 1e-7)) for name in ("time", "azimuth", "elevation")
        },
    }
    groups = {
        "truth": truth,
        "truth/targets": targets,
        "truth/emissions": emitted,
        "source_estimates": estimates,
        "cloud": {name: (("frame", "point"), values) for name, values in columns.items()},
    }
    made = xr.DataTree.from_dict({name: xr.Dataset(group) for name, group in groups.items()})
    made.attrs = {"band_low": 25e3, "band_high": 85e3, "assumed_sound_speed": 1500.0, "aperture_radius": 0.6}
    return made


def row(checks: list[Any], name: str) -> Any:
    return next(check for check in checks if check.name == name)


ALL = np.arange(4)


def test_good_data_pass_without_a_warning() -> None:
    checks = [*range_errors(tree(), ALL), *bounds(tree(), ALL)]
    assert all(check.ok is not False and not check.warning for check in checks)
    numbers = row(checks, "predicted range errors").numbers
    assert numbers["points"] == 400 and numbers["off_target"] == 0
    assert numbers["pull_rms"] == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize(
    ("given", "which"),
    [
        ({"error": 5.0, "predicted": 5.0}, "ranges"),
        ({"error": 0.01, "predicted": 5.0}, "ranges"),
        ({"snap_error": 9.0, "snap_predicted": 15.0}, "4 of 4 estimates"),
        ({"snap_predicted": 9.0}, "4 of 4 estimates"),
    ],
)
def test_honest_data_of_no_use_are_warned_of_and_do_not_fail(given: dict[str, float], which: str) -> None:
    """Errors as predicted, but larger than the target and the beam, or than half of the distance of the snap."""
    checks = [*range_errors(tree(**given), ALL), *bounds(tree(**given), ALL)]
    assert all(check.ok is not False for check in checks)
    (warning,) = [check.warning for check in checks if check.warning]
    assert warning.startswith(which)


def test_errors_that_contradict_their_predictions_fail() -> None:
    check = row(range_errors(tree(error=0.05, predicted=0.01), ALL), "predicted range errors")
    assert check.ok is False and check.frames == (0, 1, 2, 3)
    few = tree(error=0.01)
    few["cloud/range"].values[2, :2] = 30.0  # two of 400: half a per cent
    assert row(range_errors(few, ALL), "predicted range errors").ok
    few["cloud/range"].values[2, :12] = 30.0  # twelve: three per cent
    check = row(range_errors(few, ALL), "predicted range errors")
    assert check.ok is False and 2 in check.frames
    absent = tree(error=0.01)
    absent["cloud/range_error"].values[:, :10] = np.nan  # no prediction keeps no promise
    assert row(range_errors(absent, ALL), "predicted range errors").ok is False


@pytest.mark.parametrize(
    ("labels", "said"),
    [
        ({"family": (60, 1)}, "240 ghosts by surface"),
        ({"family": (60, 2)}, "240 ghosts by bottom"),
        ({"origin": (60, ORIGINS.index("mirror image"))}, "240 mirror images"),
        ({"origin": (60, ORIGINS.index("grating lobe"))}, "240 in grating lobes"),
        ({"origin": (60, ORIGINS.index("unexplained")), "target": (60, -1)}, "240 unexplained"),
        ({"origin": (60, ORIGINS.index("snap itself")), "target": (60, -1)}, "240 the snap itself"),
    ],
)
def test_what_no_range_is_judged_of_is_named_counted_and_warned_of(labels: dict[str, Any], said: str) -> None:
    """However wrong the ranges of ghosts and strangers are, no error of the target's range is made of them."""
    store = tree(**labels)
    store["cloud/range"].values[:, :60] += 3.0
    checks = range_errors(store, ALL)
    assert all(check.ok is not False for check in checks)
    whose = row(checks, "origin of points")
    assert said in whose.got and "160 points on target, 240 off" in whose.got
    assert said in whose.warning and whose.warning.startswith("only 40 % of the points")
    assert row(checks, "range of points on target").numbers["points"] == 160


@pytest.mark.parametrize(("predicted", "honest"), [(2.0, True), (0.02, False)])
def test_ranges_by_another_snap_than_lit_them_are_within_what_is_predicted(predicted: float, honest: bool) -> None:
    """60 of the 100 points of each frame are lit by the second snap, and placed by the first, 3 m off."""
    store = tree(emission=(60, 1))
    store["cloud/range"].values[:, :60] += 3.0
    store["cloud/range_error"].values[:, :60] = predicted
    checks = range_errors(store, ALL)
    assert "160 points on target, 240 off (240 lit by another snap)" in row(checks, "origin of points").got
    assert row(checks, "predicted range errors").ok
    check = row(checks, "ranges by another snap")
    assert check.ok is honest and check.frames == (() if honest else (0, 1, 2, 3))


def test_a_store_whose_points_have_no_labels_is_not_judged_by_them() -> None:
    old = tree()
    del old["cloud"]["lit_by"]
    (check,) = range_errors(old, ALL)
    assert check.ok is None and "no labels" in check.got
    assert [c.name for c in bounds(old, ALL)] == ["snap located"]


def test_an_estimate_of_no_snap_is_a_miss_however_near_it_is() -> None:
    store = tree()
    assert row(bounds(store, ALL), "snap located").ok
    store["source_estimates/emission"].values[:] = -1
    found = row(bounds(store, ALL), "snap located")
    assert found.ok is False and "4 farther from every snap" in found.got and "nan" not in found.got


@pytest.mark.parametrize(("away", "useful"), [(0.3, True), (15.0, False)])
def test_the_direction_of_a_transmitter_beside_the_array_may_err_by_more_than_a_beam(away: float, useful: bool) -> None:
    """Told to a centimetre it is 4 degrees off, which moves ranges by 2 cm, less than the band tells apart."""
    store = tree(snap_error=0.0, snap_predicted=0.01)
    for place in ("source_estimates/position", "truth/emissions/position"):
        store[place].values[:] *= away / 15.0
    store["source_estimates/azimuth_error"].values[:] = 4.0
    assert ("useless" in row(bounds(store, ALL), "snap located").warning) != useful
