"""Laws of the chain from scene to signals, image and labels."""

import weakref
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from sonarsynth.conventions import azimuth_elevation
from sonarsynth.equations.arrays.apertures import element_directivity
from sonarsynth.equations.bubble.snap_pressure import spectrum
from sonarsynth.equations.noise.filters import response
from sonarsynth.pipeline import beamform_frame, render, synthesise, trace_frame
from sonarsynth.pipeline.synthesis import frame_signals, prepared_sound
from sonarsynth.planning import PRODUCTS, plan
from sonarsynth.recipe import Recipe
from sonarsynth.scattering import MirrorLobe
from sonarsynth.signals import GriddedSynthesis
from sonarsynth.signals.filtered_pulse import fir
from sonarsynth.targets.shapes import Remus100
from tests.scenes import point_scene, remus

SIGNALS = frozenset({"signals"})
TARGET, SNAP = (20.0, 4.0, -47.0), (15.0, -6.0, -56.0)


@lru_cache(maxsize=8)
def _planned(recipe: Recipe, products: frozenset[str] = frozenset(PRODUCTS)):
    return plan(recipe, products)


def _one_facet(recipe: Recipe):
    """Plan, trace of one facet of the point target alone, with the facet's place."""
    made = _planned(recipe, SIGNALS)
    traced = trace_frame(made, 0)
    arrivals = traced.arrivals
    keep = np.flatnonzero(~arrivals.direct)[:1]
    return made, replace(traced, arrivals=arrivals.select(keep)), arrivals.point[keep][0]


def test_a_point_scatterer_gives_the_closed_form() -> None:
    """Delay, 1/r, 1/r, level and face directivity at each hydrophone, from formulas alone."""
    made, traced, point = _one_facet(point_scene(TARGET, SNAP))
    sonar, snap = made.scene.sonar, traced.frame.moment.snaps[0]
    signals = synthesise(made, traced)
    samples, rate = made.windows.samples, sonar.sampling_frequency
    sensors = traced.frame.sonar_pose.to_world(made.elements.position)
    out, back = np.linalg.norm(point - snap.position), np.linalg.norm(sensors - point, axis=1)
    arrives = (out + back) / 1500.0 - signals.start
    look = traced.frame.sonar_pose.turn_to_body(point - sensors) / back[:, None]
    padded = 4 * samples
    f = np.fft.rfftfreq(padded, 1 / rate)
    pulse = spectrum(f, snap.model.bubble) * response(f, fir(sonar.antialias))
    closed = np.exp(-2j * np.pi * f * arrives[:, None]) * pulse * 1e-4 / (out * back)[:, None]
    closed *= element_directivity(f, look[:, None, :], made.elements.face, 1500.0)
    exact = np.fft.irfft(closed, padded, axis=1)[:, :samples] * rate
    assert np.abs(signals.pressure - exact).max() <= 1e-4 * np.abs(exact).max()


class Louder(GriddedSynthesis):
    """Twice as loud as the synthesis that it is made of."""

    def signals(self, arrivals, snaps, reception):
        heard = super().signals(arrivals, snaps, reception)
        return replace(heard, pressure=2.0 * heard.pressure)


def test_what_a_synthesis_made_of_another_says_is_heard_and_sums_are_not_kept() -> None:
    made, traced, _ = _one_facet(point_scene(TARGET, SNAP))
    louder = replace(made, choices=replace(made.choices, synthesis=Louder()))
    plain = replace(made, choices=replace(made.choices, synthesis=GriddedSynthesis()))
    sounds = [prepared_sound(of, traced.frame, traced.arrivals) for of in (plain, louder)]
    one, two = (
        frame_signals(of, traced.frame, traced.arrivals, sound=sound)
        for of, sound in zip((plain, louder), sounds, strict=True)
    )
    np.testing.assert_array_equal(two.pressure, 2.0 * one.pressure)
    kept = weakref.ref(one.pressure)
    del one
    assert kept() is None  # frames of a block have theirs one after the other


def test_the_image_of_a_point_peaks_at_its_place() -> None:
    for y in (-6.0, 6.0):
        for z in (-56.0, -45.0):
            recipe = point_scene((20.0, y, z), SNAP)
            made = _planned(recipe)
            traced = trace_frame(made, 0)
            image = beamform_frame(made, 0, traced).image
            row, column = np.unravel_index(np.argmax(image.energy), image.energy.shape)
            azimuth, elevation = azimuth_elevation(traced.frame.sonar_pose.to_body([20.0, y, z]))
            half = 0.51 * np.deg2rad(1.0)  # the nearest beam of the grid
            assert abs(image.azimuth[column] - azimuth) <= half and abs(image.elevation[row] - elevation) <= half


def test_render_is_pure_and_labelled() -> None:
    recipe = remus()
    first, second = render(recipe, 1), render(recipe, 1)
    assert first.identical(second)
    assert first["signals/pressure"].attrs["units"] == "Pa"
    for node in first.subtree:
        for name, variable in node.variables.items():
            assert "units" in variable.attrs and "long_name" in variable.attrs, (node.path, name)


def test_truth_agrees_with_the_arrivals_that_made_the_signals() -> None:
    """Facets that a beam points at are among those that echo or face away; ranges agree with the arrivals' points."""
    traced = trace_frame(_planned(remus()), 0)
    truth, arrivals, pose = traced.truth, traced.arrivals, traced.frame.sonar_pose
    on = truth.beam_target >= 0
    assert on.any()
    for facet, distance in zip(truth.beam_facet[on], truth.beam_range[on], strict=True):
        mesh, body = traced.frame.moment.bodies[0].mesh, traced.frame.moment.bodies[0]
        corners = np.linalg.norm(pose.to_body(body.pose.to_world(mesh.corners[facet])), axis=1)
        assert corners.min() - 0.02 <= distance <= corners.max() + 0.02
    low_az, high_az, low_el, high_el = truth.image_box[0]
    echoes = ~arrivals.direct
    azimuth, elevation = azimuth_elevation(arrivals.direction[echoes])
    assert low_az <= azimuth.min() and azimuth.max() <= high_az
    assert low_el <= elevation.min() and elevation.max() <= high_el
    assert 0.9 < truth.visible_fraction[0] <= 1.0


def test_what_nobody_asked_for_is_not_computed(monkeypatch: pytest.MonkeyPatch) -> None:
    made = plan(remus(), ("signals",))
    monkeypatch.setattr("sonarsynth.pipeline.locate_and_image", lambda *_: pytest.fail("signals were processed"))
    heard = beamform_frame(made, 0, trace_frame(made, 0))
    assert heard.image is None and heard.estimates is None


def _brightest(edge: float, phases: str) -> float:
    """Mean over frames of the brightest beam (dB) of the small scene with facets of this edge."""
    recipe = remus(frames=6)
    target = replace(recipe.scene.world.targets[0], shape=Remus100(edge=edge))
    scene = replace(
        recipe.scene,
        world=replace(recipe.scene.world, targets=(target,)),
        physics=replace(recipe.scene.physics, scattering=MirrorLobe(width=np.deg2rad(30), phases=phases)),
    )
    made = plan(replace(recipe, scene=scene))
    images = [beamform_frame(made, i, trace_frame(made, i)).image for i in range(6)]
    return float(np.mean([10 * np.log10(image.energy.max()) for image in images]))


@pytest.mark.long
def test_levels_do_not_depend_on_the_number_of_facets() -> None:
    """Powers of facets with random signs add; with all signs alike half the edge, four times the facets, gives 6 dB."""
    assert abs(_brightest(0.02, "random") - _brightest(0.04, "random")) < 3.0
    assert _brightest(0.02, "alike") - _brightest(0.04, "alike") == pytest.approx(6.0, abs=1.5)
