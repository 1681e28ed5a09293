"""Reflections turn and blur the pulse otherwise at each hydrophone: one expansion over the array against each alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.environment.boundaries import Rigid, SeaBottom, SeaSurface, Sediment
from sonarsynth.environment.sea import Absorption, Environment, Isovelocity
from sonarsynth.equations.scattering.facet_pulses import facet_response
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.products import Arrivals
from sonarsynth.products.array_expansion import QUANTITIES
from sonarsynth.propagation import AutoTracing
from sonarsynth.receiver import POINT, BandPass, Elements, Sonar
from sonarsynth.scattering import FacetLaw, Kirchhoff, MirrorLobe, PartlyReflecting
from sonarsynth.signals import DirectSum, GriddedSynthesis
from sonarsynth.signals.array_paths import array_paths
from sonarsynth.signals.pulse_variation import from_the_sharpest
from sonarsynth.signals.segments import Reception
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.sources.transmitter import Sweep
from sonarsynth.state import Emission, FrameContext, Medium, Receiver
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Box
from sonarsynth.tracing.arrivals import trace
from tests.echoes import EAST, PROFILE, ROMANIS, C
from tests.laws.test_synthesis import some_of

PLACE = np.array([0.0, 0.0, -5.0])
SINGLE = replace(POINT, face=ROMANIS.face)
SAND = SeaBottom(reflection=Sediment(name="medium sand"))
HARD = SeaBottom(reflection=Rigid())
ROUGH = SeaSurface(rms_height=0.006)
SNAP = Emission(np.array([14.0, -5.0, -9.5]), 0.0, LogarithmicBubble(), None)
SONAR = Sonar()
BAND = SONAR.band
EDGES = np.array([BAND.low, BAND.centre, BAND.high])
PANEL = mesh_of(Box(size=(0.006, 0.06, 0.06), edge=0.006))
LIME = Kirchhoff(surface=PartlyReflecting(density_ratio=2.0, speed_ratio=1.6, loss_tangent=0.02))
FAR = np.array(
    [int(np.argmax(ROMANIS.position[:, 2])), int(np.argmin(ROMANIS.position[:, 1] + ROMANIS.position[:, 2]))]
)
START = 0.006


def traced(surface: SeaSurface, bottom: SeaBottom, law: FacetLaw, place: Floats, array: Elements = ROMANIS) -> Arrivals:
    water = Environment(
        depth=10.0,
        sound_speed=Isovelocity(speed=C),
        absorption=Absorption(formula="none"),
        surface=surface,
        bottom=bottom,
    )
    panel = PlacedTarget("panel", PANEL, Pose(PLACE + [12.0, 1.5, 0.2], quaternion(0.7)), np.zeros(3))
    receiver = Receiver(Pose(place, EAST), array, SONAR)
    return trace(FrameContext(0.0, (panel,), (SNAP,), Medium(water, PROFILE), receiver, (law,)), AutoTracing(bounces=2))


def alone(*scene: object, sensor: int) -> Arrivals:
    """Traced to a single hydrophone in the middle of an array of its own."""
    place = Pose(PLACE, EAST).to_world(ROMANIS.position[sensor][None])[0]
    return traced(*scene, place, SINGLE)  # type: ignore[arg-type]


def heard(found: Arrivals, q: Floats) -> Floats:
    """Each path (path, frequency) at a place in the sonar frame, at the edges and the centre of the band."""
    over = {name: found.expansion.over(name, q[None])[:, 0] for name in QUANTITIES}
    away = np.linalg.norm(found.radius[:, None] * found.direction - q, axis=1)
    late = found.delay + (away - found.radius) / C + over["delay"]
    amplitude = found.amplitude * found.radius / away * (1.0 + over["amplitude"])
    phase = found.phase + over["phase"]
    soft = np.exp(-0.5 * np.multiply.outer(found.delay_std**2 + over["delay_variance"], (2.0 * np.pi * EDGES) ** 2))
    shape = facet_response(
        EDGES, found.coherent, found.corner_delays, found.coherent_fraction, found.height_delay_std, found.centre
    )
    turn = np.exp(1j * (phase[:, None] - 2.0 * np.pi * late[:, None] * EDGES))
    return amplitude[:, None] * soft * shape * turn


def key(found: Arrivals) -> np.ndarray:
    """A number (path,) for each path: its target, facet and family."""
    return np.ravel_multi_index(
        (found.target + 1, found.facet + 1, found.surface, found.bottom, found.arrives_by), (3, 10000, 4, 4, 4)
    )


def both(one: Arrivals, other: Arrivals) -> tuple[Arrivals, Arrivals]:
    """The paths that both have, in one order: bodies hide other facets from other hydrophones. Without those that have
    their number with others, as by surface and bottom and by bottom and surface."""
    keys, rows = [], []
    for found in (one, other):
        _, first, count = np.unique(key(found), return_index=True, return_counts=True)
        rows.append(first[count == 1])
        keys.append(key(found)[rows[-1]])
    _, mine, theirs = np.intersect1d(*keys, assume_unique=True, return_indices=True)
    return one.select(rows[0][mine]), other.select(rows[1][theirs])


SCENES = [
    pytest.param((SeaSurface(), SAND, MirrorLobe(width=0.5)), 1e-3, id="lossy bottom"),
    pytest.param((ROUGH, HARD, MirrorLobe(width=0.5)), 1e-3, id="rough surface"),
    pytest.param((SeaSurface(), HARD, LIME), 1e-2, id="partly reflecting body"),
    pytest.param((ROUGH, SAND, LIME), 1e-2, id="all"),
]


@pytest.mark.parametrize(("scene", "most"), SCENES)
def test_each_family_at_the_edges_of_the_band_is_that_of_a_hydrophone_alone(scene: tuple, most: float) -> None:
    """Path by path, relative to the family, or to a fifth of all echoes; five times better than without these terms.

    What is left is the directivity of facets, which all hydrophones share, so that those of the body are small.
    """
    found = traced(*scene, PLACE)
    worst, plain = 0.0, 0.0
    for sensor in FAR:
        exact = alone(*scene, sensor=sensor)
        mine, theirs = both(found, exact)
        q = ROMANIS.position[sensor]
        flat = replace(mine, expansion=mine.expansion.without("phase", "delay_variance"))
        truth = heard(theirs, np.zeros(3))
        all_echoes = np.linalg.norm(truth[~theirs.direct], axis=0)
        family = 64 * (mine.target + 1) + 16 * mine.surface + 4 * mine.bottom + mine.arrives_by
        for rows in (family == f for f in np.unique(family)):
            size = np.maximum(np.linalg.norm(truth[rows], axis=0), 0.2 * all_echoes)
            for way, x in (("terms", mine), ("plain", flat)):
                error = (np.linalg.norm((heard(x, q) - truth)[rows], axis=0) / size).max()
                worst, plain = max(worst, error * (way == "terms")), max(plain, error * (way == "plain"))
    assert worst < most
    assert plain > 5.0 * worst


@pytest.mark.parametrize(("scene", "most"), SCENES[:3])
def test_signals_of_one_expansion_are_those_of_each_hydrophone_alone(scene: tuple, most: float) -> None:
    """In time, direct arrivals and echoes of the paths that both have, by the fast synthesis."""
    found = traced(*scene, PLACE)
    method = GriddedSynthesis(precision="float64", tolerance=1e-6, width=12, oversampling=2.0)
    for sensor in FAR[:1]:
        exact = alone(*scene, sensor=sensor)
        mine, theirs = both(found, exact)
        for direct in (True, False):
            some, other = mine.select(mine.direct == direct), theirs.select(theirs.direct == direct)
            got = method.pressure(some, (SNAP,), Reception(ROMANIS, SONAR, None, START, 4000))[0][sensor]
            want = method.pressure(other, (SNAP,), Reception(SINGLE, SONAR, None, START, 4000))[0][0]
            assert np.linalg.norm(want) > 0.0
            assert np.linalg.norm(got - want) < most * np.linalg.norm(want)


def test_boundaries_that_are_alike_at_all_angles_need_no_terms() -> None:
    found = traced(SeaSurface(), HARD, MirrorLobe(width=0.5), PLACE)
    assert (found.surface > 0).any() and (found.bottom > 0).any()
    assert found.expansion.phase.shape == found.expansion.delay_variance.shape == (len(found.delay), 0)


def test_every_edge_of_a_blur_is_within_the_window_or_counted() -> None:
    """A path that is sharp at the centre and blurred at the rim is heard whole there."""
    found = traced(*SCENES[1].values[0], PLACE)
    one = found.select(np.flatnonzero(found.direct & (found.surface == 1) & (found.bottom == 0)))
    terms = np.where(np.isin(one.expansion.monomials, (7, 9)), 4e-10, 0.0)[None]  # yy and zz
    one = replace(one, expansion=replace(one.expansion, delay_variance=terms).without("phase"))
    array = some_of(ROMANIS, 25)
    exact = DirectSum().signals(one, (SNAP,), Reception(array, SONAR, None, START, 4000)).pressure
    got = GriddedSynthesis(precision="float64", tolerance=1e-6).signals(
        one, (SNAP,), Reception(array, SONAR, None, START, 4000)
    )
    assert np.abs(got.pressure - exact).max() < 1e-4 * np.abs(exact).max()
    size = np.linalg.norm(exact, axis=1)
    assert size.max() > 2.0 * size.min()


@pytest.mark.parametrize("amplify", [1.0, 4.0])
def test_the_fast_synthesis_changes_pulses_as_the_exact_one_does(amplify: float) -> None:
    """Both kinds of change at once, families mixed, and as they are or four times as large."""
    found = traced(*SCENES[3].values[0], PLACE)
    over = found.expansion
    over = replace(over, phase=amplify * over.phase, delay_variance=amplify * over.delay_variance)
    found = replace(found, expansion=over)
    found = found.select(np.concatenate([np.flatnonzero(found.direct), np.flatnonzero(~found.direct)[::80]]))
    array = some_of(ROMANIS, 25)
    for direct in (True, False):
        part = found.select(found.direct == direct)
        want = DirectSum().signals(part, (SNAP,), Reception(array, SONAR, None, START, 4000)).pressure
        for method, most in (
            (GriddedSynthesis(), 2e-4),
            (GriddedSynthesis(precision="float64", tolerance=1e-6, width=12), 2e-6),
        ):
            got = method.signals(part, (SNAP,), Reception(array, SONAR, None, START, 4000)).pressure
            assert np.abs(got - want).max() < most * np.abs(want).max()


def test_blur_counted_from_the_sharpest_place_is_the_same_at_every_hydrophone() -> None:
    """Which both syntheses take it from: never sharper than a plain pulse, and more blurred from there on."""
    found = traced(SeaSurface(rms_height=0.1), HARD, MirrorLobe(width=0.5), PLACE)
    front = array_paths(found.select(np.flatnonzero(~found.direct)[::10]), (SNAP,), ROMANIS)
    again, points = from_the_sharpest(front, 85e3), ROMANIS.position
    spread = [of.expansion.over("delay_variance", points) for of in (front, again)]
    total = [of.variance[:, None] + own for of, own in zip((front, again), spread, strict=True)]
    np.testing.assert_allclose(total[1], total[0], rtol=0, atol=1e-12 * total[0].max())
    moved = again.variance != front.variance
    assert moved.any() and (again.variance >= 0.0).all() and (spread[0][moved] < 0.0).any()
    assert spread[1][moved].min() > -1e-12 * total[0].max()


@pytest.mark.parametrize("height", [0.03, 0.05, 0.1, 0.3])
def test_sharp_paths_are_none_the_worse_for_paths_by_a_rough_sea_beside_them(height: float) -> None:
    """Of those little is left, while what is left changes by factors of e to the 10 and more over the aperture."""
    found = traced(SeaSurface(rms_height=height), HARD, MirrorLobe(width=0.5), PLACE)
    found = found.select(np.flatnonzero(~found.direct)[::40])
    assert (found.expansion.largest("delay_variance") * 0.5 * (2.0 * np.pi * 85e3) ** 2 > 5.0).any()
    hears = Reception(some_of(ROMANIS, 25), SONAR, None, START, 4000)
    exact = DirectSum().signals(found, (SNAP,), hears).pressure
    assert np.isfinite(exact).all()
    for tolerance, most in ((1e-4, 1e-4), (1e-5, 1e-5)):
        method = GriddedSynthesis(tolerance=tolerance, precision="float64", width=8)
        got = method.signals(found, (SNAP,), hears).pressure
        assert np.abs(got - exact).max() < most * np.abs(exact).max()


def test_a_path_of_which_blur_leaves_nothing_but_0_hz_is_heard() -> None:
    """A sweep by a rough sea and by sand, which turns it otherwise at each hydrophone: to a hundredth of what little is
    left, where plans ended with a division by zero."""
    sweep = replace(SNAP, model=Sweep(start=15e3, stop=24e3, duration=1e-3))
    found = traced(ROUGH, SAND, MirrorLobe(width=0.5), PLACE)
    one = found.select(np.flatnonzero(found.direct & (found.surface == 1) & (found.bottom == 1))[:1])
    assert one.expansion.phase.any()
    one = replace(one, delay_std=np.array([1e-4]))
    sonar = replace(SONAR, filter=BandPass(low=15e3, high=24e3))
    hears = Reception(some_of(ROMANIS, 25), sonar, None, START, 8000)
    exact, got = (method.signals(one, (sweep,), hears).pressure for method in (DirectSum(), GriddedSynthesis()))
    assert 0.0 < np.abs(exact).max() < 1e-6 and np.abs(got - exact).max() < 1e-2 * np.abs(exact).max()
