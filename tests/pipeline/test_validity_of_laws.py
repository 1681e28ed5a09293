"""Where laws of scattering hold is asked of every law: in the plan, in the store, and in target strengths."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import sonarsynth as ss
from sonarsynth.equations.scattering.modal_series import sphere_amplitude
from sonarsynth.pipeline.variables import attributes
from sonarsynth.planning import arrivals_of, plan
from sonarsynth.scattering import Scatterer, Scattering
from sonarsynth.scattering.facet_law import FacetLaw
from sonarsynth.scattering.law_notes import SmallBody
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.target_strength import target_strength

C = 1500.0
BAND = (25e3, 85e3)


def scene(radius: float, law: Scattering, snap: tuple[float, float, float] = (0.1, 0.2, -25.0)) -> ss.Recipe:
    ball = ss.Target(
        name="ball",
        shape=ss.Sphere(radius=radius, edge=radius / 6.0),
        motion=ss.Still(position=(10.0, 0.0, -25.0)),
        scattering=law,
    )
    world = ss.World(
        environment=ss.Environment(depth=50.0, sound_speed=ss.Isovelocity(speed=C)),
        targets=(ball,),
        sources=(ss.SnappingShrimp(position=snap),),
    )
    sonar = ss.Sonar(array=ss.PlanarLattice(columns=2, rows=2, pitch=0.02), beams=ss.BeamGrid(azimuths=3, elevations=3))
    trajectory = ss.Trajectory(sonar=ss.Still(position=(0.0, 0.0, -25.0), heading=0.5 * np.pi))
    return ss.Recipe(scene=ss.Scene(world=world, sonar=sonar, trajectory=trajectory))


def body(radius: float, **more: float) -> Scatterer:
    mesh = mesh_of(ss.Sphere(radius=radius, edge=radius / 6.0))
    return Scatterer(mesh, C / BAND[1], C / BAND[0], **more)


def test_a_sphere_of_a_millimetre_is_too_loud_by_what_the_plan_and_the_store_say() -> None:
    """35 dB at 25 kHz, 14 dB at 85 kHz: as an echo of the scene itself is, against the exact series."""
    made = plan(scene(1e-3, ss.MirrorLobe()), ())
    (note,) = [line for line in made.warnings if line.startswith("ball: 0.002 m across is ka 0.1 to 0.36")]
    least, most = map(float, re.findall(r"[-+]\d+\.\d(?= )", note))
    found = arrivals_of(made, made.recipe.frame(0)[1])
    found = found.select(~found.direct)
    level = 10.0 * np.log10((found.scattering**2).sum())
    exact = 20.0 * np.log10(np.abs(sphere_amplitude(np.array(BAND), np.pi, radius=1e-3, sound_speed=C)))
    assert (level - exact)[::-1] == pytest.approx([least, most], abs=0.5)
    assert most > 34.0 and least > 12.0
    (stored,) = [line for line in attributes(made)["validity"] if line.startswith("ball: mirror_lobe: 0.002 m across")]
    assert stored.endswith(note.removeprefix("ball: "))


@pytest.mark.parametrize(
    "law", [ss.MirrorLobe(), ss.MirrorLobe(width=0.1), ss.Kirchhoff(), ss.Kirchhoff(surface="soft")]
)
def test_a_law_that_holds_says_nothing_and_the_store_says_so(law: ss.MirrorLobe | ss.Kirchhoff) -> None:
    assert law.validity(body(0.25)) == ()
    made = plan(scene(0.25, law), ())
    assert not any(line.startswith("ball: ") and "ka" in line for line in made.warnings)
    assert made.validity[0].startswith(f"ball: {law.kind}: holds, by size, facets and angles: ka 2")


@pytest.mark.parametrize(
    ("law", "asked", "said"),
    [
        (ss.MirrorLobe(), body(0.01), "too small"),
        (ss.Kirchhoff(), body(0.01), "of a rigid sphere as wide Kirchhoff's integral is"),
        (ss.Kirchhoff(surface="soft"), body(0.001), "of a soft sphere as wide Kirchhoff's integral is"),
        (ss.Isotropic(), body(0.5), "and not the level of a body"),
        (ss.MirrorLobe(), body(3.0), "wavelengths at the top of the band"),
        (ss.MirrorLobe(), body(0.5, angle=2.5), "143 degrees off backscatter"),
        (ss.Kirchhoff(), body(0.5, angle=2.5), "143 degrees off backscatter"),
        (ss.MirrorLobe(width=1.0), body(0.5), "a lobe so wide returns 1.1"),
        (ss.MirrorLobe(phases="alike"), body(0.5), "the level depends on their number"),
        (ss.Kirchhoff(roughness=1e-3, slope=0.1), body(0.5), "heights of 1 mm with slopes of 0.1 are 14 mm wide"),
        (ss.Kirchhoff(), body(0.5, distance=2.0, aperture=0.65), "nearer than 2.6 m"),
    ],
)
def test_each_law_says_where_it_does_not_hold(law: Scattering, asked: Scatterer, said: str) -> None:
    assert [line for line in law.validity(asked) if said in line], law.validity(asked)
    assert all("\n" not in line for line in law.validity(asked))


def test_a_kirchhoff_surface_with_forward_scattering_or_large_gentle_heights_is_right() -> None:
    assert ss.Kirchhoff(forward="scattered").validity(body(0.5, angle=3.0)) == ()
    assert ss.Kirchhoff(roughness=0.02, slope=0.2).validity(body(0.5)) == ()


def test_the_angle_asked_about_is_that_of_the_frames() -> None:
    """A snap beyond the ball: it is lit from behind."""
    notes = plan(scene(0.5, ss.MirrorLobe(), snap=(20.0, 1.0, -26.0)), ()).warnings
    assert any(re.match(r"ball: seen up to 17\d degrees off backscatter", note) for note in notes)


def test_target_strengths_by_lobes_warn_of_small_bodies_too() -> None:
    way = np.array([1.0, 0.0, 0.0])
    with pytest.warns(SmallBody, match="this law is"):
        target_strength(ss.Sphere(radius=1e-3), 55e3, way, -way, C, ss.MirrorLobe())


def test_a_law_of_ones_own_is_asked_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ss.Isotropic, "validity", lambda self, body: (f"made for ka {body.ka[0]:.3g}",))
    recipe = scene(0.1, ss.Isotropic())
    assert "ball: made for ka 10.5" in plan(recipe, ()).warnings
    assert "ball: isotropic: made for ka 10.5" in plan(replace(recipe, seed=2), ()).validity


@pytest.mark.parametrize(
    ("times", "said"), [(0.5, ""), (1.0, ""), (3.0, "scatters 3 times"), (1e12, "scatters 1e+12 times")]
)
def test_a_law_that_gives_back_more_than_it_gets_is_noted(
    monkeypatch: pytest.MonkeyPatch, times: float, said: str
) -> None:
    """Of one that scatters alike over half of all directions, 2 pi |f|^2 is what it gives back."""
    monkeypatch.setattr(ss.Isotropic, "validity", FacetLaw.validity)
    area = float(np.median(scene(0.1, ss.Isotropic()).scene_of(0).meshes[0].area))
    strength = np.sqrt(times * area * np.cos(np.deg2rad(40.0)) / (2.0 * np.pi))
    law = ss.Isotropic(strength=float(strength))
    assert law.returned_share(area) == pytest.approx(times, rel=1e-3)
    notes = [line for line in plan(scene(0.1, law), ()).warnings if "the power that reaches a facet" in line]
    assert [line.split(" the power")[0] for line in notes] == ([f"ball: {said}"] if said else [])
    assert ss.MirrorLobe().returned_share(area) == pytest.approx(1.0, abs=0.01)
    assert ss.Kirchhoff().returned_share(area) == 0.0, "it has parts of its own"
