"""Paths of a frame as a store has them: summed they are the signals, and their geometry is that of the stored truth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.fft import irfft
from scipy.spatial.transform import Rotation

import sonarsynth as ss
from sonarsynth.environment.sea import Absorption
from sonarsynth.geometry.motion import Still
from sonarsynth.planning import plan
from sonarsynth.planning.measured import path_counts
from sonarsynth.propagation import AutoTracing
from sonarsynth.receiver.hydrophones import PositionTable
from sonarsynth.recipe import Recipe
from sonarsynth.signals.filtered_pulse import pulse_spectrum
from tests.scenes import remus

SPEED = 1540.0


def still(bounces: int = 0, signal: float = 1e-5) -> Recipe:
    """A REMUS-100 at rest, heard by one hydrophone; nothing is absorbed."""
    base = remus(1, array=PositionTable(positions=((0.0, 0.0, 0.0),), face=1e-5), assumed_sound_speed=SPEED)
    scene = base.scene
    body = replace(scene.world.targets[0], motion=Still(position=(20.0, 1.0, -4.5), heading=0.3))
    water = replace(scene.world.environment, absorption=Absorption(formula="none"))
    world = replace(scene.world, targets=(body,), environment=water)
    physics = replace(scene.physics, tracing=AutoTracing(bounces=bounces))
    accuracy = replace(base.accuracy, signal=signal)
    return replace(base, accuracy=accuracy, scene=replace(scene, world=world, physics=physics))


def paths_of(tree: Any) -> Any:
    """The paths that there are, without padding."""
    return tree["paths"].dataset.isel(path=slice(int(tree["paths"]["count"])))


@pytest.mark.parametrize("bounces", [0, 1])
def test_the_sum_of_the_stored_paths_is_what_the_hydrophone_hears(bounces: int) -> None:
    made = plan(still(bounces), {"signals", "paths"})
    tree = ss.render(made, 0)
    paths, pressure = paths_of(tree), tree["signals"]["pressure"].to_numpy()[0].astype(float)
    sonar, snap = made.scene.sonar, made.recipe.frame(0)[1].moment.snaps[0]
    samples = 4 * len(pressure)
    frequency, pulse = pulse_spectrum(snap.waveform, sonar.antialias, sonar.sampling_frequency, samples)
    late = paths.delay.to_numpy() - float(tree["signals"]["start"])
    turned = np.exp(-2j * np.pi * frequency * late[:, None] + 1j * paths.phase.to_numpy()[:, None].astype(float))
    blurred = turned * np.exp(-0.5 * (2 * np.pi * frequency * paths.delay_std.to_numpy()[:, None].astype(float)) ** 2)
    spectrum = pulse * (paths.amplitude.to_numpy().astype(float) @ blurred)
    heard = sonar.sampling_frequency * irfft(spectrum, samples)[: len(pressure)]
    assert len(set(paths.family.to_numpy().tolist())) == (1 if bounces == 0 else 3)
    assert np.abs(heard - pressure).max() < 2e-5 * np.abs(pressure).max()


def test_delays_and_directions_are_those_of_facets_in_the_stored_truth() -> None:
    tree = ss.render(plan(still(), ["paths"]), 0)
    paths, truth, mesh = paths_of(tree), tree["truth/targets"].dataset.isel(target=0), tree["targets/remus"]
    w, x, y, z = truth.orientation.to_numpy()
    corners = mesh["vertices"].to_numpy()[mesh["faces"].to_numpy()]
    middle = Rotation.from_quat([x, y, z, w]).apply(corners.mean(axis=1)) + truth.position.to_numpy()
    snap, sonar = tree["truth/emissions"]["position"].to_numpy()[0], tree["truth"]["sonar_position"].to_numpy()
    echo = paths.isel(path=np.flatnonzero(paths.target.to_numpy() == 0))
    assert echo.sizes["path"] > 100
    out, back = middle[echo.facet] - snap, middle[echo.facet] - sonar
    length = np.linalg.norm(out, axis=1) + np.linalg.norm(back, axis=1)
    assert np.allclose(echo.delay, length / SPEED, atol=1e-12)
    assert np.allclose(echo.length, length, rtol=1e-6)
    assert np.allclose(echo.radius, np.linalg.norm(back, axis=1), rtol=1e-6)
    # the sonar looks east: forward x, to port y
    assert np.allclose(echo.azimuth, np.rad2deg(np.arctan2(back[:, 1], back[:, 0])), atol=1e-4)
    assert np.allclose(echo.elevation, np.rad2deg(np.arctan2(back[:, 2], np.hypot(back[:, 0], back[:, 1]))), atol=1e-4)


def test_paths_without_sound_are_the_same_and_what_has_no_room_is_the_faintest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe = still(signal=1e-3)
    beside = paths_of(ss.render(plan(recipe, {"signals", "paths"}), 0))
    ss.build(recipe, tmp_path / "paths.zarr", products=["paths"], workers=0)
    store = ss.open(tmp_path / "paths.zarr")
    alone = paths_of(store.isel(frame=0))
    assert {"signals", "image", "cloud"}.isdisjoint(store.children)
    assert alone.drop_vars("frame", errors="ignore").equals(beside)
    monkeypatch.setattr(path_counts, "ROOM", 0.3)
    few = paths_of(ss.render(plan(recipe, ["paths"]), 0))
    room = int(np.ceil(0.3 * alone.sizes["path"]))
    assert (few.sizes["path"], int(few.overflow)) == (room, alone.sizes["path"] - room)
    loudest = np.sort(np.argsort(-np.abs(alone.amplitude.to_numpy()), kind="stable")[:room])
    assert np.array_equal(few.delay, alone.delay[loudest])
