"""Odd scenes through the whole chain: every number that leaves it is finite, or NaN because there is none."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from sonarsynth import evaluation, store
from sonarsynth.description import FieldError
from sonarsynth.environment.noise import FlatNoise, WenzNoise
from sonarsynth.environment.sea import Environment, Isovelocity, Tabulated
from sonarsynth.geometry.motion import Circle, Still
from sonarsynth.imaging import DenseDelayAndSum, FocusedDelayAndSum
from sonarsynth.pipeline import render
from sonarsynth.planning import PRODUCTS, Plan, plan
from sonarsynth.propagation import Straight
from sonarsynth.receiver import BeamGrid, Converter, LowPass, PlanarLattice, PositionTable, Sonar
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.scene import EchoWindow, Physics, Processing, Scene, Trajectory, World
from sonarsynth.scattering import Kirchhoff
from sonarsynth.schedule import build
from sonarsynth.sources.shrimp import LogarithmicBubble, SnappingShrimp
from sonarsynth.targets.shapes import Box, Sphere
from sonarsynth.targets.target import Target

LATTICE = PlanarLattice(columns=12, rows=12, pitch=0.05)
BEAMS = BeamGrid(azimuths=11, elevations=11)


def ball(at: tuple[float, float, float] = (10.0, 1.0, -5.0), radius: float = 0.5, name: str = "ball") -> Target:
    return Target(name=name, shape=Sphere(radius=radius, edge=0.2 * radius), motion=Still(position=at))


def shrimp(*position: float, **more: Any) -> SnappingShrimp:
    return SnappingShrimp(position=position, **more)


def scene(
    targets: tuple[Target, ...] = (ball(),),
    snaps: tuple[SnappingShrimp, ...] = (shrimp(14.0, -4.0),),
    environment: dict[str, Any] | None = None,
    sonar: dict[str, Any] | None = None,
    trajectory: dict[str, Any] | None = None,
    **more: Any,
) -> Recipe:
    water = {"depth": 12.0, "sound_speed": Isovelocity(speed=1540.0)} | (environment or {})
    return Recipe(
        scene=Scene(
            world=World(environment=Environment(**water), targets=targets, sources=snaps),
            sonar=Sonar(**({"array": LATTICE, "beams": BEAMS} | (sonar or {}))),
            trajectory=Trajectory(**(trajectory or {})),
            **more,
        )
    )


def layered(depth: tuple[float, ...], speed: tuple[float, ...]) -> dict[str, Any]:
    return {"sound_speed": Tabulated(depth=depth, speed=speed)}


def table(*positions: tuple[float, float, float]) -> dict[str, Any]:
    return {
        "sonar": {"array": PositionTable(positions=positions)},
        "processing": Processing(beamforming=DenseDelayAndSum()),
    }


HEARD: dict[str, Recipe] = {
    "no targets": scene(targets=()),
    "no targets, refracted": scene(targets=(), environment=layered((0.0, 12.0), (1540.0, 1500.0))),
    "behind the array": scene((ball((-10.0, 0.0, -5.0)),)),
    "out of the field of view": scene((ball((3.0, 8.0, -5.0)),)),
    "touching the surface": scene((ball((10.0, 0.0, -0.5)),)),
    "touching the bottom": scene((ball((10.0, 0.0, -11.5)),)),
    "one target behind another": scene((ball((10.0, 0.0, -5.0), 0.8), ball((14.0, 0.0, -5.0), 0.3, "far"))),
    "two shrimp": scene(snaps=(shrimp(14.0, -4.0), shrimp(9.0, 6.0))),
    "two snaps": scene(snaps=(shrimp(14.0, -4.0, snap_times=(0.0, 0.02)),)),
    "snap in front of the target": scene((ball((17.0, 0.0, -5.0)),), (shrimp(9.0, 0.0, -5.0),)),
    "a millimetre": scene((ball(radius=1e-3),)),
    "twelve facets": scene((Target(name="box", shape=Box(size=(0.5, 0.5, 0.5)), motion=Still(position=(10, 1, -5))),)),
    "500 m": scene(
        (ball((500.0, 0.0, -405.0), 2.0),),
        (shrimp(300.0, -30.0),),
        {"depth": 1000.0},
        trajectory={"sonar": Still(position=(0.0, 0.0, -400.0), heading=0.5 * np.pi)},
    ),
    "a thermocline": scene(environment=layered((0.0, 4.0, 6.0, 12.0), (1540.0, 1540.0, 1500.0, 1495.0))),
    "a jump below the array": scene(environment=layered((0.0, 5.5, 5.5, 12.0), (1540.0, 1540.0, 1500.0, 1500.0))),
    "a profile of one node": scene(environment=layered((3.0,), (1520.0,))),
    "straight rays asked for": scene(
        environment=layered((0.0, 12.0), (1540.0, 1500.0)), physics=Physics(tracing=Straight())
    ),
    "a wide low-pass filter": scene(sonar={"filter": LowPass(cutoff=110e3), "sampling_frequency": 250e3}),
    "noise": scene(environment={"noise": WenzNoise()}),
    "one beam": scene((ball((10.0, 0.0, -5.0)),), sonar={"beams": BeamGrid(azimuths=1, elevations=1)}),
    "one column of beams": scene((ball((10.0, 0.0, -5.0)),), sonar={"beams": BeamGrid(azimuths=1, elevations=11)}),
    "3 x 3 points": scene(sonar={"array": PlanarLattice(columns=3, rows=3, pitch=0.1, face=0.0)}),
    "tilted on a circle": scene(
        (ball((0.0, 12.0, -5.0)),),
        (shrimp(3.0, 14.0),),
        trajectory={
            "frames": 2,
            "interval": 1.0,
            "sonar": Circle(centre=(0.0, 0.0, -5.0), radius=2.0, speed=1.0, bearing=np.pi, pitch=0.1, roll=0.4),
        },
    ),
}
"""Scenes whose snap is heard."""

UNHEARD: dict[str, Recipe] = {
    "no shrimp": scene(snaps=()),
    "neither": scene((), ()),
    "no shrimp but noise": scene(snaps=(), environment={"noise": FlatNoise(level=40.0)}),
    "no shrimp, refracted": scene(snaps=(), environment=layered((0.0, 12.0), (1540.0, 1500.0))),
    "the direct path is blocked": scene((ball((7.0, -2.0, -8.5), 0.8),)),
    "a target before the snap": scene((ball((7.0, 0.0, -5.0)),), (shrimp(14.0, 0.0, -5.0),)),
    "a snap that absorption leaves nothing of": scene(snaps=(shrimp(9e5, 0.0),)),
    "less than a count of the converter": scene(sonar={"converter": Converter(bits=8, full_scale=1e5)}),
    "louder noise": scene(environment={"noise": FlatNoise(level=150.0)}),
    "one hydrophone": scene(**table((0.0, 0.0, 0.0))),
    "two at one place": scene(**table((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))),
    "a row": scene(sonar={"array": PlanarLattice(columns=16, rows=1, pitch=0.05)}),
    "a column": scene(sonar={"array": PlanarLattice(columns=1, rows=16, pitch=0.05)}),
    "all dead but one": scene(sonar={"array": PlanarLattice(columns=4, rows=4, pitch=0.05, dead=tuple(range(15)))}),
}
"""Scenes of which the array cannot tell where a snap is, or when."""


def frame_of(recipe: Recipe) -> tuple[Plan, xr.DataTree]:
    """The first frame, none of whose numbers is infinite; those of `/` and `/signals` are not NaN either."""
    made = plan(recipe, (*PRODUCTS, "paths"))
    tree = render(made, 0)
    paths = tree["paths"].dataset
    there = np.arange(paths.sizes["path"]) < int(paths["count"])
    assert all((np.isfinite(paths[name]) == there).all() for name in ("delay", "azimuth", "amplitude", "radius"))
    for node in tree.subtree:
        for name, variable in node.to_dataset(inherit=False).variables.items():
            if variable.dtype.kind == "f":
                assert not np.isinf(variable.values).any(), f"{node.path}/{name}"
                assert node.path not in ("/", "/signals") or np.isfinite(variable.values).all(), f"{node.path}/{name}"
    return made, tree


@pytest.mark.parametrize("which", HEARD)
def test_a_frame_whose_snap_is_heard_has_an_image(which: str) -> None:
    made, tree = frame_of(HEARD[which])
    image, signals = tree["image"], tree["signals"]
    assert np.isfinite(image.energy).all()
    assert int(signals.outside) == 0
    assert float(signals.start) <= float(image.start) < float(image.stop)
    assert float(image.stop) <= float(signals.start) + made.windows.samples / made.scene.sonar.sampling_frequency
    found = np.isfinite(tree["cloud"].range.values)
    for name in ("range_error", "delay", "energy", "x", "y", "z"):
        assert (np.isfinite(tree["cloud"][name].values) == found).all(), name
    assert (tree["cloud"].range_error.values[found] > 0).all()
    assert (tree["cloud"].range.values[found] > 0).all()


@pytest.mark.parametrize("which", UNHEARD)
def test_a_frame_whose_snap_is_not_found_is_whole_and_says_nothing_of_it(which: str) -> None:
    """Its image is of the record that there is."""
    made, tree = frame_of(UNHEARD[which])
    start, end = float(tree["signals"].start), made.windows.samples / made.scene.sonar.sampling_frequency
    assert start <= float(tree["image"].start) < float(tree["image"].stop) <= start + end
    assert int(tree["source_estimates"].usable) == 0
    for name in (
        "cloud/range",
        "source_estimates/time",
        "source_estimates/position",
    ):
        assert np.isnan(tree[name].values).all(), name
    assert np.isfinite(tree["truth/targets"].position).all()


def test_a_step_in_speed_or_a_shadow_across_the_array_is_said_to_be_beyond_the_expansion() -> None:
    """Every sensor has one ray from the step's other side, and the wavefront errs by a tenth of a period or more. Where
    some are in the shadow of a fast layer none holds over the aperture, and its error is NaN."""
    step = (0.0, 4.9, 5.1, 12.0), (1540.0, 1540.0, 1450.0, 1450.0)
    fast_layer = (0.0, 5.1, 5.15, 5.2, 12.0), (1450.0, 1450.0, 1540.0, 1450.0, 1450.0)
    for profile, some_have_none in ((step, False), (fast_layer, True)):
        made, tree = frame_of(scene(environment=layered(*profile)))
        error = float(tree["link_budget"].wavefront_error)
        assert np.isnan(error) if some_have_none else error * made.scene.sonar.band.centre > 0.1
        assert int(tree["cloud"]["count"]) == 0


def test_the_snap_that_is_heard_best_starts_the_clock() -> None:
    """Of two shrimp the farther one is heard better, off the sides of the elements' beams: its echoes are imaged."""
    tree = render(HEARD["two shrimp"], 0)
    time = tree["source_estimates"].time.values
    assert time[0] > time[1]
    assert float(tree["image"].start) > time[0]


def test_a_target_that_hides_another() -> None:
    truth = render(HEARD["one target behind another"], 0)["truth"]
    assert truth["targets"].visible_fraction.values == pytest.approx([1.0, 0.0])
    assert set(np.unique(truth["beams"].target)) == {-1, 0}


def test_clipped_samples_are_counted() -> None:
    tree = render(scene(sonar={"converter": Converter(bits=8, full_scale=0.5)}), 0)
    pressure = tree["signals"].pressure.values
    assert int(tree["signals"].clipped) > 100
    assert np.abs(pressure).max() <= 0.5


def test_less_is_computed_for_less() -> None:
    groups, levels = {"truth", "targets"}, {"link_budget"}
    heard = (((), set()), (("signals",), {"signals"} | levels), (("image",), {"image", "source_estimates"} | levels))
    for products, more in heard:
        assert set(render(plan(scene(), products), 0).children) == groups | more


BUILT = ("one beam", "no targets", "500 m", "one hydrophone", "the direct path is blocked")


@pytest.mark.parametrize("which", BUILT)
def test_odd_stores_are_whole(which: str, tmp_path: Path) -> None:
    recipe = (HEARD | UNHEARD)[which]
    assert build(recipe, tmp_path / "odd.zarr", workers=0).ok
    report = store.verify(tmp_path / "odd.zarr", [evaluation.check])
    assert not report.problems
    rows = {row.name: row for row in report.checks}
    assert rows["link budget adds up"].ok
    if which in ("no shrimp", "the direct path is blocked"):  # nothing to find is nothing to blame
        assert rows["snap located"].ok is None and not rows["snap located"].warning
    if which == "one hydrophone":  # it was there to be heard
        assert rows["snap located"].ok is None and "array_tells_no_direction" in rows["snap located"].warning


REFUSED = [
    (scene((ball((1e200, 0.0, -5.0)),)), "scene.world.targets.0.motion: target 'ball' is more than 1e+06 m from"),
    (scene((ball((1e5, 0.0, -5.0)),)), "scene.processing.echo_window: a frame would take 8"),
    (
        scene(snaps=(shrimp(14.0, -4.0, snap=LogarithmicBubble(a=1e9)),)),
        "scene.world.sources.0.snap: makes a source level",
    ),
    (
        scene(snaps=(shrimp(14.0, -4.0, snap=LogarithmicBubble(m=-1e3)),)),
        "scene.world.sources.0.snap: grows for 1e+03 s",
    ),
    (scene(snaps=(shrimp(14.0, -4.0, snap=LogarithmicBubble(q=-1e-9)),)), "scene.world.sources.0.snap: grows for"),
    (
        scene(processing=Processing(echo_window=EchoWindow(start=1e-3, stop=1.000001e-3))),
        "scene.processing.echo_window: is 1e-09 s long",
    ),
    (
        scene(processing=Processing(echo_window=EchoWindow(start=0.5, stop=0.1))),
        "scene.processing.echo_window.stop: must be after start",
    ),
    (
        scene(
            sonar={"array": PositionTable(positions=((0.0, 0.0, 0.0), (0.0, 0.1, 0.0)))},
            processing=Processing(beamforming=FocusedDelayAndSum()),
        ),
        "scene.processing.beamforming.kind: 'focused' needs an array on a lattice",
    ),
    (scene(snaps=(shrimp(10.0, 1.0, -5.0),)), "scene.world.sources.0.position: is inside target 'ball' at frame 0"),
    (
        scene((Target(name="dome", shape=Sphere(radius=1.0), motion=Still(position=(0.5, 0, -5))),)),
        "scene.world.targets.0.motion: target 'dome' contains the sonar at frame 0",
    ),
]


@pytest.mark.parametrize(
    ("recipe", "message"), REFUSED, ids=[m.partition(":")[0] + str(i) for i, (_, m) in enumerate(REFUSED)]
)
def test_scenes_that_cannot_be_are_refused_before_anything_is_computed(recipe: Recipe, message: str) -> None:
    with pytest.raises(FieldError) as caught:
        plan(recipe)
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


def test_a_target_too_small_for_its_law_is_announced() -> None:
    law = Kirchhoff()
    for radius, small in ((0.001, True), (0.3, False)):
        ball = Target(name="ball", shape=Sphere(radius=radius), motion=Still(position=(10, 0, -5)), scattering=law)
        made = plan(scene((ball,)))
        assert any(note.startswith("ball: 0.002 m across is") for note in made.warnings) == small


def test_a_snap_from_behind_is_announced() -> None:
    notes = plan(scene(snaps=(shrimp(-10.0, 0.0, -7.0),))).warnings
    assert any("come from behind the array" in note for note in notes)


@pytest.mark.parametrize("bounces", [0, 2])
def test_no_echo_passes_for_the_direct_pulse_in_half_a_metre_of_water(bounces: int) -> None:
    """Sound by the boundaries comes within a few pulses: the snap is found where it is, or refused with the reason."""
    made = plan(
        scene(
            (ball((4.0, 0.3, -0.25), 0.1),),
            (shrimp(2.5, -1.5),),
            {"depth": 0.5},
            {"array": PlanarLattice(columns=16, rows=8, pitch=0.01)},
            {"sonar": Still(position=(0.0, 0.0, -0.25), heading=np.pi / 2)},
            physics=Physics(tracing=Straight(bounces=bounces)),
        )
    )
    frame = render(made, 0)
    found, truth = frame["source_estimates"].dataset, frame["truth/emissions"].dataset
    accepted = found["reason"].values == 0
    assert accepted.any() or bounces
    assert np.isnan(found["time"].values[~accepted]).all()
    for name in ("azimuth", "elevation"):
        off = np.abs(found[name].values - truth[name].values)[accepted]
        assert (off <= 4.0 * found[f"{name}_error"].values[accepted]).all()
