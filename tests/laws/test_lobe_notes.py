"""What plans say of grating lobes, against the brightest beam that a rendered image has so far beside its target; and
of arrays and bands that locate nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sonarsynth import plan, render
from sonarsynth.equations.arrays.grating_lobes import loudest_lobe
from sonarsynth.planning.measured.sampled_frames import sample_frames
from sonarsynth.planning.notes import source_notes
from sonarsynth.receiver import Band, BeamGrid, PlanarLattice
from sonarsynth.recipe import Recipe
from sonarsynth.sources.snap_models import Gabor
from tests.scenes import point_scene

ACROSS = 0.2
"""Sine of how far to port the target is: its lobe is as far to starboard or farther."""


def recipe(cycles: float, pitch: float) -> Recipe:
    """A point and a lattice of so many metres, in the light of a tone of 60 kHz of so many cycles."""
    distance = 12.0
    place = (distance * np.cos(np.arcsin(ACROSS)), distance * ACROSS, -50.0)
    array = PlanarLattice(columns=16, rows=12, pitch=pitch, face=0.01)
    beams = BeamGrid(azimuth_span=np.deg2rad(60), azimuths=241, elevation_span=np.deg2rad(4), elevations=9)
    own = point_scene(place, (8.0, 0.0), array=array, beams=beams)
    (source,) = own.scene.world.sources
    world = replace(own.scene.world, sources=(replace(source, snap=Gabor(frequency=60e3, cycles=cycles)),))
    return replace(own, scene=replace(own.scene, world=world))


@pytest.mark.parametrize(("cycles", "pitch"), [(3.0, 0.05), (8.0, 0.05), (8.0, 0.07), (30.0, 0.07)])
def test_a_lobe_is_as_loud_and_as_far_away_as_is_said(cycles, pitch, monkeypatch) -> None:
    """Within 1 dB and 2.5 degrees of the image."""
    monkeypatch.setattr(source_notes, "LOBE", 1e-3)
    own = recipe(cycles, pitch)
    (line,) = source_notes.lobe_notes(sample_frames(own))
    degrees = float(line.split("about ")[1].split(" deg")[0])
    below = float(line.split("it, ")[1].split(" dB")[0])
    image = render(own, 0)["image/energy"]
    row = image.isel(elevation=len(image.elevation) // 2)
    level = 10.0 * np.log10(row / row.max())
    sine = np.sin(np.deg2rad(level.azimuth))
    far = np.abs(sine - float(sine[int(row.values.argmax())])) > 0.5 * 1500.0 / (60e3 * pitch)
    lobe = level.where(far)
    apart = abs(float(sine[int(np.nanargmax(lobe.values))]) - float(sine[int(row.values.argmax())]))
    assert -float(lobe.max()) == pytest.approx(below, abs=1.0)
    assert np.rad2deg(2.0 * np.arcsin(0.5 * apart)) == pytest.approx(degrees, abs=2.5)


@pytest.mark.parametrize(("pitch", "orders"), [(0.07, 5), (0.15, 12), (2.0, 160)])
def test_lobes_of_more_orders_than_are_followed_are_said(pitch: float, orders: int) -> None:
    """Up to (1 + sin 30 degrees) wavelengths apart at the upper edge of the band; and a frame of them is made."""
    own = recipe(3.0, pitch)
    (reach,) = {1.5 * pitch * look.scene.sonar.band.high / 1500.0 for look in sample_frames(own)}
    assert orders <= reach < 1.1 * orders + 1
    said = [line for line in source_notes.lobe_notes(sample_frames(own)) if "orders of grating lobes" in line]
    assert len(said) == (orders > 12)
    assert float(render(own, 0)["image/energy"].max()) > 0.0


def test_a_tone_has_a_lobe_as_loud_as_its_main_one_and_a_dense_array_none() -> None:
    tone = np.array([60e3 - 1e-3, 60e3 + 1e-3]), np.ones(2)
    sine, level = loudest_lobe(np.full(12, 12), 0.05, *tone, 1500.0, 2.0)
    assert sine == pytest.approx(0.5, abs=1e-6) and level == pytest.approx(1.0, abs=1e-6)
    assert loudest_lobe(np.full(12, 12), 0.01, *tone, 1500.0, 2.0)[1] == 0.0
    assert loudest_lobe(np.full(12, 12), 0.05, *tone, 1500.0, 0.4)[1] == 0.0


def test_a_plan_says_it_of_tones_and_not_of_snaps() -> None:
    long, short = plan(recipe(8.0, 0.07)), plan(point_scene((12.0, 2.4, -50.0), (8.0, 0.0)))
    assert any("grating lobe" in line for line in long.warnings)
    assert not any("grating lobe" in line for line in short.warnings)


@pytest.mark.parametrize(
    ("sonar", "located"),
    [
        ({"array": PlanarLattice(columns=1, rows=1, pitch=0.05)}, False),
        ({"array": PlanarLattice(columns=9, rows=1, pitch=0.05)}, False),
        ({"array": PlanarLattice(columns=8, rows=2, pitch=0.05)}, True),
        ({"band": Band(low=55e3, high=55.8e3)}, False),
        ({"band": Band(low=50e3, high=60e3)}, True),
    ],
)
def test_a_plan_says_where_nothing_can_be_located(sonar, located) -> None:
    """And frames are as it says."""
    own = plan(point_scene((12.0, 2.4, -50.0), (8.0, 0.0, 0.0), **sonar))
    assert any("no snap is located" in line for line in own.warnings) != located
    assert bool(np.isfinite(render(own, 0)["source_estimates/time"]).all()) == located
