"""Ghosts: targets that the array sees mirrored in surface and bottom, read from a store and drawn at their place."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

from sonarsynth import schedule
from sonarsynth.conventions import direction
from sonarsynth.equations.arrays.grating_lobes import grating_lobes, lattice_pitch
from sonarsynth.pictures import show
from sonarsynth.pictures.figures.frame_figure import FramePicture, Hull, View
from sonarsynth.pictures.figures.ghost_rings import Ghost, place
from sonarsynth.pictures.figures.style import pixels
from sonarsynth.pictures.store_reading import FAINTEST, ghosts, opened, stored
from sonarsynth.planning import plan
from sonarsynth.recipe import reading

FAMILIES = ["direct", "surface", "bottom", "surface and bottom"]
FRAME = np.array([100.0, 50.0, 500.0, 650.0])
AZIMUTH, ELEVATION = np.linspace(-25.0, 25.0, 51), np.linspace(-32.0, 32.0, 65)


def tree(
    level: list[float], elevation: list[float], azimuth: list[float] | None = None, targets: int = 1
) -> xr.DataTree:
    """A store of one frame with the echoes of a target (each target has the same)."""
    dims = ("frame", "target", "family")
    rows = {"level": level, "elevation": elevation, "azimuth": azimuth or [0.0] * len(FAMILIES)}
    truth = xr.Dataset({f"echo_{name}": (dims, np.array([[row] * targets])) for name, row in rows.items()})
    names = [f"t{i}" for i in range(targets)]
    truth = truth.assign_coords(family=FAMILIES, target=names)
    return xr.DataTree.from_dict({"truth/targets": truth})


def names(found: tuple[Ghost, ...]) -> list[str]:
    return [ghost.name for ghost in found]


def test_ghosts_are_all_families_but_the_direct_one() -> None:
    found = ghosts(tree([120.0, 118.0, 117.0, 108.0], [1.0, 25.0, -27.0, 44.0], [5.0, 6.0, 7.0, 8.0]), 0)
    assert found == (
        Ghost("surface ghost", 0, 6.0, 25.0, -2.0),
        Ghost("bottom ghost", 0, 7.0, -27.0, -3.0),
        Ghost("surface and bottom ghost", 0, 8.0, 44.0, -12.0),
    )


@pytest.mark.parametrize(("under", "count"), [(FAINTEST - 0.1, 1), (FAINTEST + 0.1, 0), (np.inf, 0), (np.nan, 0)])
def test_a_ghost_that_cannot_be_seen_is_not_drawn(under: float, count: int) -> None:
    nan = np.nan
    assert len(ghosts(tree([120.0, 120.0 - under, nan, nan], [0.0, 20.0, nan, nan]), 0)) == count


def test_without_a_direct_echo_levels_are_those_below_the_strongest() -> None:
    found = ghosts(tree([np.nan, 100.0, 90.0, np.nan], [np.nan, 20.0, -20.0, np.nan]), 0)
    assert [ghost.level for ghost in found] == [0.0, -10.0]


@pytest.mark.parametrize(("both", "drawn"), [(44.0, True), (-46.0, True), (10.5, False), (-3.0, False)])
def test_the_mean_of_echoes_from_above_and_below_is_no_ghost(both: float, drawn: bool) -> None:
    found = ghosts(tree([120.0, 118.0, 118.0, 110.0], [1.0, 25.0, -27.0, both]), 0)
    assert ("surface and bottom ghost" in names(found)) == drawn


def test_several_targets_are_named_and_a_store_without_echoes_has_no_ghosts() -> None:
    two = tree([120.0, 118.0, np.nan, np.nan], [1.0, 25.0, np.nan, np.nan], targets=2)
    assert names(ghosts(two, 0)) == ["t0: surface ghost", "t1: surface ghost"]
    assert [ghost.target for ghost in ghosts(two, 0)] == [0, 1]
    assert ghosts(xr.DataTree.from_dict({"truth": xr.Dataset()}), 0) == ()


def boxed(middle: np.ndarray, size: np.ndarray) -> np.ndarray:
    return np.concatenate([middle - 0.5 * size, middle + 0.5 * size])


def common(a: np.ndarray, b: np.ndarray) -> bool:
    return bool((np.minimum(a[2:], b[2:]) - np.maximum(a[:2], b[:2]) > 1e-9).all())


@given(st.floats(0, 1), st.floats(0, 1), st.floats(0, 1), st.floats(0, 1))
def test_a_label_is_inside_and_covers_neither_its_ring_nor_the_target(x: float, y: float, u: float, v: float) -> None:
    at, other = (FRAME[:2] + 6 + np.array(p) * (FRAME[2:] - FRAME[:2] - 12) for p in ((x, y), (u, v)))
    size, ring = np.array([110.0, 14.0]), np.array([12.0, 12.0])
    taken = [boxed(at, ring), boxed(other, np.array([30.0, 8.0]))]
    label = boxed(place(at, size, 12.0, FRAME, taken), size)
    assert (label[:2] >= FRAME[:2] - 1e-9).all() and (label[2:] <= FRAME[2:] + 1e-9).all()
    assert not any(common(label, box) for box in taken)


def test_labels_point_away_from_the_middle_where_there_is_room() -> None:
    size = np.array([80.0, 14.0])
    assert place(np.array([300.0, 500.0]), size, 12.0, FRAME, [])[1] > 500.0
    assert place(np.array([300.0, 200.0]), size, 12.0, FRAME, [])[1] < 200.0


@pytest.fixture(scope="module")
def picture() -> FramePicture:
    return FramePicture(AZIMUTH, ELEVATION, [view()], "dB")


def view(*seen: Ghost) -> View:
    square = np.array([[20.0, 1.0, 0.0], [20.0, -1.0, 0.0], [20.0, -1.0, 1.0], [20.0, 1.0, 1.0]])
    hull = Hull("plate", square, np.array([[0, 1, 2], [0, 2, 3]]))
    level = np.full((len(ELEVATION), len(AZIMUTH)), -30.0)
    return View("drawn", level, np.zeros((0, 3)), np.zeros(0), (hull,), tuple(seen))


def changed(picture: FramePicture, *seen: Ghost) -> tuple[np.ndarray, np.ndarray]:
    """Azimuth and elevation (deg) of the pixels that drawing ghosts changes."""
    picture.show(view())
    without = pixels(picture.figure).astype(int)
    picture.show(view(*seen))
    rows, columns = np.nonzero(np.abs(pixels(picture.figure) - without).max(axis=2) > 40)
    at = np.stack([columns + 0.5, len(without) - rows - 0.5], axis=1)
    azimuth, elevation = picture.figure.axes[0].transData.inverted().transform(at).T
    return azimuth, elevation


def test_ghosts_are_drawn_at_their_place_and_leave_nothing_behind(picture: FramePicture) -> None:
    ghost = Ghost("surface ghost", 0, 10.0, 25.0, -2.0)
    picture.show(view())
    clean = pixels(picture.figure)
    azimuth, elevation = changed(picture, ghost)
    near = np.hypot(azimuth - 10.0, elevation - 25.0) < 1.5
    assert near.sum() > 20
    assert np.abs([azimuth[near].mean() - 10.0, elevation[near].mean() - 25.0]).max() < 0.15
    assert elevation[~near].min() > 25.0  # the label, above
    assert np.abs(azimuth[~near].mean() - 10.0) < 1.0
    picture.show(view())
    assert (pixels(picture.figure) == clean).all()


@pytest.mark.parametrize("where", [(0.0, 60.0), (0.0, -60.0), (70.0, 0.0), (-70.0, 0.0), (60.0, 60.0)])
def test_a_ghost_outside_is_an_arrow_at_the_edge(picture: FramePicture, where: tuple[float, float]) -> None:
    azimuth, elevation = changed(picture, Ghost("bottom ghost", 0, *where, -2.0))
    assert len(azimuth) > 40
    assert np.abs(azimuth).max() <= 25.5 and np.abs(elevation).max() <= 32.5
    reach = np.array([azimuth, elevation]).T @ np.sign(where)
    assert reach.max() > 24.0 * np.count_nonzero(where)


def test_no_label_covers_the_target(picture: FramePicture) -> None:
    for elevation in (3.0, 4.0, -1.5):
        azimuth, height = changed(picture, Ghost("surface ghost", 0, 0.0, elevation, -2.0))
        beyond = np.abs(azimuth) > 1.3  # more than the ring
        inside = beyond & (np.abs(azimuth) < 2.8) & (height > 0.1) & (height < 2.7)
        assert beyond.sum() > 20 and not inside.any()


@pytest.mark.parametrize(("shrimp", "reference"), [(-5, "direct"), (30, "strongest")])
def test_stored_ghosts_lie_where_the_mirror_images_are(
    small_text: str, tmp_path: Path, shrimp: int, reference: str
) -> None:
    """Isovelocity water 12 m deep, array and box 5 m down and 10 m apart; a shrimp before the box and one behind it.

    The images are 10 m above and 14 m below, and by two bounces 24 m above and below.
    """
    text = small_text.replace("elevation_span: 30 deg", "elevation_span: 140 deg").replace("[12, 8]", f"[{shrimp}, 1]")
    made = plan(reading.loads(text + "  physics: {tracing: {kind: auto, bounces: 2}}\n"))
    assert schedule.build(made, tmp_path / "small.zarr", frames=range(1), workers=0).ok
    said: list[str] = []
    files = show(tmp_path / "small.zarr", tmp_path / "pictures", say=said.append)
    assert files[0].read_bytes().startswith(b"\x89PNG")
    found = {ghost.name: ghost for ghost in stored(opened(tmp_path / "small.zarr"), 0).ghosts}
    assert {"surface ghost", "bottom ghost"} <= set(found)
    images = {"surface ghost": [10.0], "bottom ghost": [-14.0], "surface and bottom ghost": [24.0, -24.0]}
    for name, ghost in found.items():
        image = np.rad2deg(np.arctan2(images[name], 10.0))
        assert np.abs(image - ghost.elevation).min() < 3.0  # half the box
        assert abs(ghost.azimuth) < 3.0
    (line,) = [line for line in said[0].splitlines() if line.startswith("  ghosts")]
    assert f"box: surface {found['surface ghost'].level:+.1f} dB, bottom {found['bottom ghost'].level:+.1f} dB" in line
    assert line.endswith(f"dB re its {reference} echo")


def test_grating_lobes_lie_where_the_lattice_cannot_tell() -> None:
    """Sensors of a lattice hear a wave from a grating lobe in step with one from the direction itself: their phases
    differ by whole turns."""
    pitch, speed = 0.05, 1500.0
    sensors = np.stack([np.zeros(35), *(g.ravel() for g in np.mgrid[0:5, 0:7] * pitch)], axis=1)
    towards, frequency = direction(np.deg2rad(-6.0), np.deg2rad(25.0)), np.array([25e3, 60e3, 85e3])
    found = grating_lobes(towards, frequency, pitch, speed)
    assert len(found)
    assert lattice_pitch(sensors) == pytest.approx(pitch)
    assert lattice_pitch(sensors * [1.0, 1.0, 1.3]) == lattice_pitch(sensors[:1]) == 0.0
    for n, f in enumerate(frequency):
        there = found[np.isfinite(found[:, n, 0]), n]
        np.testing.assert_allclose(np.linalg.norm(there, axis=1), 1.0, rtol=1e-12)
        assert np.abs(there - towards).max(axis=1).min() > 0.3  # none is the direction itself
        turns = f / speed * (there - towards) @ (sensors - sensors[0]).T
        np.testing.assert_allclose(turns, turns.round(), atol=1e-9)
        reach = int(2.0 * pitch * f / speed)
        orders = np.mgrid[-reach : reach + 1, -reach : reach + 1].reshape(2, -1).T
        every = towards[1:] + orders * speed / (f * pitch)
        assert len(there) == sum(u @ u < 1.0 for u in every) - 1


def test_grating_lobes_are_drawn_over_the_band_and_leave_the_axes_alone(picture: FramePicture) -> None:
    lobe = np.stack([np.linspace(10.0, 80.0, 30), np.full(30, 12.0)], axis=1)
    picture.show(view())
    without, limits = pixels(picture.figure).astype(int), picture.figure.axes[0].get_xlim()
    picture.show(replace(view(), lobes=(lobe,)))
    rows, columns = np.nonzero(np.abs(pixels(picture.figure) - without).max(axis=2) > 40)
    at = np.stack([columns + 0.5, len(without) - rows - 0.5], axis=1)
    azimuth, elevation = picture.figure.axes[0].transData.inverted().transform(at).T
    assert picture.figure.axes[0].get_xlim() == limits
    assert np.abs(elevation - 12.0).max() < 1.0
    assert azimuth.min() == pytest.approx(10.0, abs=1.0) and azimuth.max() == pytest.approx(25.5, abs=1.0)
