"""Facets that reshape pulses: the fast synthesis against the slow exact sum, and what neither takes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sonarsynth.conventions import Floats
from sonarsynth.description import FieldError
from sonarsynth.equations.scattering.facet_pulses import facet_response
from sonarsynth.equations.scattering.kirchhoff_integral import shadow_taper
from sonarsynth.products import Arrivals
from sonarsynth.receiver import POINT, LowPass, Sonar
from sonarsynth.signals import DirectSum, GriddedSynthesis
from sonarsynth.signals.array_paths import array_paths
from sonarsynth.signals.filtered_pulse import pulse_spectrum
from sonarsynth.signals.pulse_shapes import MOST_PHASE, shape_modes
from sonarsynth.sources.snap_models import Ricker
from sonarsynth.sources.snap_pulses import waveform
from tests.hearing import hearing
from tests.laws.test_synthesis import (
    FACES,
    MODEL,
    SHARP,
    SNAPS,
    SONAR,
    C,
    absorption,
    arrivals,
    error,
    some_of,
    target_at,
)

LOW = Sonar(filter=LowPass(cutoff=60e3, attenuation=140), sampling_frequency=250e3)
PRECISE = GriddedSynthesis(precision="float64", width=14, tolerance=1e-10)


def facets(
    of: Arrivals, seed: int, *, coherent: float = 0.0, corners: float = 0.0, share: float = 0.0, rough: float = 0.0
) -> Arrivals:
    """Some of the paths coherent, all with corners and roughness of random sizes up to these (s)."""
    rng, n = np.random.default_rng(seed), of.delay.size
    return replace(
        of,
        coherent=rng.random(n) < coherent,
        corner_delays=rng.uniform(-corners, corners, (n, 3)) * rng.random((n, 1)),
        coherent_fraction=np.where(rng.random(n) < 0.5, share, rng.uniform(0.0, share, n)),
        height_delay_std=rng.uniform(0.0, rough, n),
    )


def shaped(of: Arrivals, seed: int) -> Arrivals:
    rng, n = np.random.default_rng(seed), of.delay.size
    doppler = rng.choice([-1e-3, 0.0, 1e-3], n)
    return replace(of, phase=rng.uniform(-9.0, 9.0, n), delay_std=rng.uniform(0.0, 5e-6, n), doppler=doppler)


KINDS = {
    "coherent": {"coherent": 1.0},
    "some coherent": {"coherent": 0.5},
    "corners": {"corners": 6e-6},
    "coherent with corners": {"coherent": 1.0, "corners": 9e-6},
    "rough": {"share": 1.0, "rough": 4e-6},
    "hardly rough": {"share": 1.0, "rough": 1e-9},
    "very rough": {"share": 0.9, "rough": 1e-3},
    "all": {"coherent": 0.5, "corners": 6e-6, "share": 1.0, "rough": 1e-5},
}


@pytest.mark.parametrize("sonar", [SHARP, LOW], ids=["band pass", "low pass"])
@pytest.mark.parametrize(
    ("kind", "also"),
    [*((kind, True) for kind in KINDS), *((kind, False) for kind in ("coherent with corners", "rough"))],
)
def test_kernel_deposit_is_the_exact_sum(kind: str, also: bool, sonar: Sonar) -> None:
    """Facets of every kind among paths of other shapes, and of two by themselves."""
    of = facets(target_at(12.0, 20, 1, direct=False), 2, **KINDS[kind])
    of = shaped(of, 3) if also else of
    array = some_of(FACES, 130)
    hears = hearing(of, sonar, array, absorption, margin=5e-4)
    exact, _ = DirectSum().pressure(of, SNAPS, hears)
    got, outside = GriddedSynthesis().pressure(of, SNAPS, hears)
    assert outside == 0
    assert 1e-14 < error(got, exact) < 1e-4
    if sonar is SHARP:
        got, _ = PRECISE.pressure(of, SNAPS, hears)
        assert error(got, exact) < 1e-9


def test_long_facets_of_a_fast_converter_are_taken_up_to_where_the_filter_stops() -> None:
    """What the series of their corners leaves out beyond is nothing, beside the exact sum."""
    of = facets(target_at(12.0, 6, 1, direct=False), 2, coherent=1.0, corners=1.8e-5)
    array, fast = some_of(FACES, 12), replace(SONAR, sampling_frequency=1e6)
    snaps = (replace(SNAPS[0], model=Ricker(frequency=400e3)),)  # most of it beyond the band
    hears = hearing(of, fast, array, absorption, margin=5e-4)
    exact, _ = DirectSum().pressure(of, snaps, hears)
    got, _ = GriddedSynthesis().pressure(of, snaps, hears)
    assert 1e-14 < error(got, exact) < 2e-4


@settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    seed=st.integers(0, 1 << 16),
    coherent=st.sampled_from([0.0, 0.4, 1.0]),
    corners=st.sampled_from([0.0, 1e-12, 1e-7, 5e-6, 1.2e-5]),
    share=st.sampled_from([0.0, 0.5, 1.0]),
    rough=st.sampled_from([0.0, 1e-11, 1e-6, 1e-2]),
    also=st.booleans(),
)
def test_any_mixture_is_the_exact_sum(
    seed: int, coherent: float, corners: float, share: float, rough: float, also: bool
) -> None:
    of = target_at(12.0, 6, seed, direct=bool(seed % 2))
    of = facets(of, seed, coherent=coherent, corners=corners, share=share, rough=rough)
    of = shaped(of, seed) if also else of
    array = some_of(FACES, 250)
    hears = hearing(of, SHARP, array, absorption, margin=5e-4)
    exact, _ = DirectSum().pressure(of, SNAPS, hears)
    got, _ = PRECISE.pressure(of, SNAPS, hears)
    assert np.isfinite(got).all()
    assert np.abs(got - exact).max() <= 1e-8 * np.abs(exact).max()


def sphere(radius: float, distance: float, parts: int) -> tuple[Arrivals, Floats]:
    """Kirchhoff echoes of the facets of a sphere, and their amplitudes (m), from a snap beside the array."""
    polar, around = np.linspace(0.0, np.pi, parts + 1), np.linspace(0.0, 2.0 * np.pi, 2 * parts + 1)
    ring = np.stack([np.cos(around), np.sin(around), np.zeros_like(around)], axis=1)
    point = radius * (np.sin(polar)[:, None, None] * ring + np.cos(polar)[:, None, None] * [0.0, 0.0, 1.0])
    a, b, c, d = point[:-1, :-1], point[1:, :-1], point[1:, 1:], point[:-1, 1:]
    corners = np.concatenate([np.stack(s, axis=2).reshape(-1, 3, 3) for s in ((a, b, c), (a, c, d))])
    area = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    corners, area = (x[np.linalg.norm(area, axis=1) > 1e-12] for x in (corners, area))
    corners = corners + [distance, 0.1 * distance, 0.05 * distance]
    middle, source = corners.mean(axis=1), np.array([0.0, -3.0, -2.0])
    out, back = np.linalg.norm(middle - source, axis=1), np.linalg.norm(middle, axis=1)
    incident, scattered = (middle - source) / out[:, None], -middle / back[:, None]
    taper = shadow_taper(incident, scattered, area / np.linalg.norm(area, axis=1, keepdims=True))
    across = incident - scattered
    f = SONAR.band.centre / C * 0.5 * np.abs(np.einsum("px,px->p", area, across)) * taper
    late = np.einsum("pcx,px->pc", corners - middle[:, None], across) / C
    delay = (out + back) / C
    of = arrivals(delay, middle, back, f / (out * back) + 1e-300, loss=0.018 * C * delay)
    of = replace(of, coherent=np.ones(len(f), bool), corner_delays=late, centre=SONAR.band.centre)
    lit = np.flatnonzero(f > 0.0)
    return of.select(lit), f[lit]


def test_a_coherent_body_whose_facets_cancel() -> None:
    """The echo of a sphere of 0.1 m is a hundredth of the sum of its facets': its error is small beside the echo."""
    of, f = sphere(0.1, 15.0, 45)
    some = np.append(np.argsort(-np.linalg.norm(FACES.position, axis=1), kind="stable")[:1], 250)
    part = FACES.select(some)
    hears = hearing(of, SONAR, part, absorption, margin=5e-4)
    exact, _ = DirectSum().pressure(of, SNAPS, hears)
    got, _ = GriddedSynthesis().pressure(of, SNAPS, hears._replace(elements=FACES))
    one = of.select(np.array([int(np.argmax(of.amplitude))]))
    alone, _ = DirectSum().pressure(one, SNAPS, hears)
    assert np.abs(of.amplitude).sum() / one.amplitude[0] * np.abs(alone).max() > 10.0 * np.abs(exact).max()
    assert error(got[some], exact) < 1e-4
    # as loud as the echo of a sphere: half its radius
    point = replace(one, amplitude=one.amplitude * 0.05 / f[np.argmax(of.amplitude)], coherent=np.zeros(1, bool))
    ball, _ = DirectSum().pressure(replace(point, corner_delays=np.zeros((1, 3))), SNAPS, hears)
    assert np.sqrt((exact**2).sum() / (ball**2).sum()) == pytest.approx(1.0, abs=0.05)


def test_facets_of_half_a_wavelength_are_few_modes() -> None:
    n, samples, rng = 400, 384, np.random.default_rng(5)
    f, spectrum = pulse_spectrum(waveform(MODEL), SHARP.antialias, SHARP.sampling_frequency, samples)
    f, spectrum = f[40:170], spectrum[40:170]
    of = facets(target_at(15.0, n, 6, direct=False), 7, corners=6e-6)
    of = replace(of, amplitude=rng.uniform(0.5, 1.0, n), absorption=np.zeros(n))
    front, none = array_paths(of, SNAPS, POINT), np.zeros((0, f.size), complex)
    modes = shape_modes(front, f, spectrum, np.zeros(f.size), none, 0.0, 3e-6)
    exact = (
        facet_response(f, np.zeros(n, bool), front.corner_delays, of.coherent_fraction, of.height_delay_std, 1.0)
        * spectrum
    )
    apart = np.abs(modes.weight @ modes.spectrum - exact).mean(axis=1).max()
    assert apart < 1e-5 * np.abs(spectrum).mean()
    assert modes.weight.shape[1] <= 8


def test_what_is_no_facet_is_refused() -> None:
    of = target_at(12.0, 4, 8, direct=False)
    hears = hearing(of, SONAR, FACES, margin=5e-4)
    n, third = 4, np.arange(4) == 2
    for columns, message in (
        (
            {"corner_delays": np.where(third[:, None], np.nan, np.zeros((n, 3)))},
            "arrival 2 has corner_delays that is not a finite",
        ),
        (
            {"corner_delays": np.where(third[:, None], [0.0, 0.02, 0.0], 0.0)},
            "arrival 2 has corners that are not within",
        ),
        ({"coherent_fraction": np.where(third, 1.1, 0.0)}, "arrival 2 has a coherent_fraction that is not from 0 to 1"),
        ({"coherent_fraction": np.where(third, -0.1, 0.0)}, "arrival 2 has a coherent_fraction"),
        ({"height_delay_std": np.where(third, -1e-9, 0.0)}, "arrival 2 has a negative height_delay_std"),
        ({"height_delay_std": np.where(third, np.inf, 0.0)}, "arrival 2 has height_delay_std that is not a finite"),
        ({"coherent": third, "centre": np.nan}, "centre of their band"),
    ):
        for method in (DirectSum(), GriddedSynthesis()):
            with pytest.raises(ValueError, match=message):
                method.signals(replace(of, **columns), SNAPS, hears)


def test_facets_too_large_for_modes_are_refused_and_the_exact_sum_takes_them() -> None:
    array = some_of(FACES, 250)
    of = target_at(12.0, 4, 9, direct=False)
    limit = MOST_PHASE / (2.0 * np.pi * 87.5e3)
    hears = hearing(of, SONAR, array, margin=5e-4)

    def of_size(size: float) -> Arrivals:
        return replace(of, corner_delays=size * np.array([[-1.0, 0.0, 1.0]] * 3 + [[-0.5, 0.0, 0.5]]))

    exact, _ = DirectSum().pressure(of_size(0.99 * limit), SNAPS, hears)
    got, _ = GriddedSynthesis().pressure(of_size(0.99 * limit), SNAPS, hears)
    assert error(got, exact) < 1e-4
    with pytest.raises(FieldError, match="direct_sum"):
        GriddedSynthesis().pressure(of_size(1.1 * limit), SNAPS, hears)
    assert np.isfinite(DirectSum().pressure(of_size(1.1 * limit), SNAPS, hears)[0]).all()
    alike = replace(
        of, corner_delays=np.tile([-3e-5, 0.0, 3e-5], (4, 1))
    )  # one shape for all is exact, whatever its size
    exact, _ = DirectSum().pressure(alike, SNAPS, hears)
    assert error(GriddedSynthesis().pressure(alike, SNAPS, hears)[0], exact) < 1e-4
