"""The link budget: levels are of energy in the band, add up, and are found again in the signals of single paths."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.equations.scattering.facet_pulses import facet_response
from sonarsynth.labels import SLICES, Band, echo_levels, family, link_budget, path_powers
from sonarsynth.products import LINK_BUDGET, Arrivals, LinkBudget
from sonarsynth.receiver import POINT, BandPass, Sonar
from sonarsynth.receiver import Band as SonarBand
from sonarsynth.signals import GriddedSynthesis
from sonarsynth.signals.direct_sum import DirectSum, relative_absorption
from sonarsynth.signals.filtered_pulse import pulse_spectrum
from sonarsynth.signals.isolated_paths import energy_in_slices, measured_levels
from sonarsynth.signals.segments import Reception
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.sources.snap_pulses import waveform
from sonarsynth.sources.transmitter import Sweep
from sonarsynth.state import Emission
from tests.laws.test_synthesis import absorption, arrivals

MODEL = LogarithmicBubble()
SNAPS = (Emission(np.zeros(3), 0.0, MODEL, None), Emission(np.ones(3), 0.0, MODEL, None, gain=0.3))
SONAR = Sonar(filter=BandPass(low=25e3, high=85e3), band=SonarBand(low=25e3, high=85e3))
LEVEL = np.array([190.0, 180.0])
LOSSES = ("transmission_loss_out", "transmission_loss_in", "absorption_loss", "boundary_loss")


def the_band(snaps: int = 2) -> Band:
    """That of SONAR, with sea water."""
    energy = np.array([energy_in_slices(waveform(MODEL), SONAR, SLICES)] * snaps).reshape(-1, SLICES)
    band = Band(25e3, 85e3, energy, np.zeros(SLICES), 0.0 * energy)
    return replace(band, relative=relative_absorption(absorption, band.frequency, 55e3))


def some_paths(count: int, seed: int, *, coherent: bool | None = None, spread: float = 1e-3) -> Arrivals:
    """Paths of two snaps, two targets and all families, of all shapes."""
    rng = np.random.default_rng(seed)
    loss = rng.uniform(0.0, 3.0, count)
    out, back, f, boundary = (rng.uniform(0.1, 1.0, count) for _ in range(4))
    signs = rng.choice([-1.0, 1.0], count)
    phases = rng.random(count) < 0.5 if coherent is None else np.full(count, coherent)
    corners = rng.uniform(-8e-6, 8e-6, (count, 3))
    some = arrivals(
        rng.uniform(0.01, 0.01 + spread, count),
        rng.normal(size=(count, 3)) + [8.0, 0.0, 0.0],
        np.full(count, 20.0),
        signs * f * out * back * boundary * 10.0 ** (-loss / 20.0),
        loss=loss,
        snap=rng.integers(0, 2, count),
        target=rng.integers(0, 2, count),
    )
    return replace(
        some,
        scattering=signs * f,
        spreading_out=out,
        spreading_in=back,
        boundary=boundary,
        surface=rng.integers(0, 2, count),
        bottom=rng.integers(0, 2, count),
        lit_by=np.zeros(count, int),
        arrives_by=rng.integers(0, 2, count),
        phase=rng.uniform(-3.0, 3.0, count),
        delay_std=rng.choice([0.0, 2e-6], count) * rng.uniform(0.5, 1.0, count),
        coherent=phases,
        corner_delays=(corners - corners.mean(axis=1, keepdims=True)) * phases[:, None],
        coherent_fraction=np.where(phases, 0.0, rng.uniform(0.0, 1.0, count)),
        height_delay_std=np.where(phases, 0.0, rng.uniform(0.0, 1e-5, count)),
    )


def transfer(of: Arrivals, f: Floats, relative: Floats) -> np.ndarray:
    """(path, bin) of each path, written out."""
    facet = facet_response(f, of.coherent, of.corner_delays, of.coherent_fraction, of.height_delay_std, of.centre)
    turn = np.exp(1j * of.phase[:, None] - 2j * np.pi * np.outer(of.delay, f))
    lost = 10.0 ** (-np.outer(of.absorption, relative) / 20.0) * np.exp(
        -0.5 * (2 * np.pi * np.outer(of.delay_std, f)) ** 2
    )
    return of.amplitude[:, None] * facet * turn * lost


def power_of(of: Arrivals, band: Band) -> float:
    """Power of paths together, |sum of the coherent|^2 and |.|^2 of each other, at all frequencies of the band."""
    each = transfer(of, band.frequency, band.relative)
    both = np.abs(each[of.coherent].sum(axis=0)) ** 2 + (np.abs(each[~of.coherent]) ** 2).sum(axis=0)
    return float(band.weight[of.snap[0]] @ both)


def levels_of(budget: LinkBudget) -> dict[str, Floats]:
    return dict(zip(LINK_BUDGET, np.moveaxis(budget.level, -1, 0), strict=True))


def booked(of: Arrivals, targets: int = 2) -> LinkBudget:
    band = the_band()
    return link_budget(of, path_powers(of, band), band, targets, LEVEL, 0.5)


def assert_it_adds_up(budget: LinkBudget) -> None:
    terms = levels_of(budget)
    total = terms["source_level"] + terms["scattering"] - sum(terms[name] for name in LOSSES)
    np.testing.assert_allclose(total, terms["received_level"], atol=1e-9)
    assert (np.isfinite(terms["received_level"]) == (budget.paths > 0)).all()


@pytest.mark.parametrize("coherent", [True, False, None])
def test_levels_are_the_energy_of_the_sums_of_paths_in_the_band(coherent: bool | None) -> None:
    of = some_paths(300, 1, coherent=coherent)
    budget, band = booked(of), the_band()
    assert_it_adds_up(budget)
    assert budget.paths.sum() == 300
    received = levels_of(budget)["received_level"]
    for snap, target, kind in np.ndindex(2, 2, 4):
        mine = of.select((of.snap == snap) & (of.target == target) & (family(of) == kind))
        expected = LEVEL[snap] + 10 * np.log10(power_of(mine, band))
        assert received[snap, target, kind] == pytest.approx(expected, abs=0.03)


@pytest.mark.parametrize("spread", [0.5, 60.0])
def test_water_takes_of_each_path_what_it_takes_at_each_frequency(spread: float) -> None:
    """Losses near their mean go by a series, others do not."""
    of, band = some_paths(50, 7, coherent=False), the_band()
    plain = {name: np.zeros(50) for name in ("delay_std", "coherent_fraction", "height_delay_std")}
    loss = np.linspace(20.0, 20.0 + spread, 50)
    steps = path_powers(replace(of, absorption=loss, **plain), band).steps
    sliced = band.sliced(16)
    left = 10.0 ** (-np.outer(loss, 1.0 + sliced.relative) / 10.0)
    np.testing.assert_allclose(steps[3] / steps[2], (sliced.weight[of.snap] * left).sum(axis=1), rtol=5e-6)
    for step, factor in ((0, of.scattering), (1, of.spreading_out), (2, of.spreading_in), (4, of.boundary)):
        np.testing.assert_allclose(steps[step], (steps[step - 1] if step else 1.0) * factor**2, rtol=1e-12)


def test_losses_are_means_of_the_losses_of_paths_and_phases_are_in_the_scattering() -> None:
    """All paths alike but for place: a common loss is that of each, whatever the phases do."""
    of = some_paths(60, 2, coherent=True)
    zero = np.zeros(60, np.int64)
    same = {"snap": zero, "target": zero, "surface": zero, "bottom": zero, "delay_std": np.zeros(60)}
    of = replace(of, spreading_out=np.full(60, 0.1), spreading_in=np.full(60, 0.05), boundary=np.full(60, 0.5), **same)
    of = replace(of, absorption=np.zeros(60), amplitude=of.scattering * 0.1 * 0.05 * 0.5)
    terms = {name: value[0, 0, 0] for name, value in levels_of(booked(of)).items()}
    assert terms["transmission_loss_out"] == pytest.approx(20.0)
    assert terms["transmission_loss_in"] == pytest.approx(26.0206)
    assert terms["boundary_loss"] == pytest.approx(6.0206)
    assert terms["absorption_loss"] == 0.0
    unit = power_of(replace(of, amplitude=of.scattering), the_band())
    assert terms["scattering"] == pytest.approx(10 * np.log10(unit), abs=0.02)


def test_what_a_rough_facet_does_not_mirror_is_in_its_scattering_and_what_the_bed_takes_is_not() -> None:
    """blur^2 is the sum of two squares: all of the loss is the target's, or the boundary's, or some of each."""
    own, others = 2e-6, 1.5e-6
    of = some_paths(1, 9, coherent=True)
    of = replace(of, boundary=np.ones(1), absorption=np.zeros(1), amplitude=of.spreading_out * of.spreading_in)
    of = replace(of, scattering=np.ones(1), corner_delays=np.zeros((1, 3)))

    def terms(delay_std: float, echo_delay_std: float) -> tuple[float, float]:
        budget = levels_of(
            booked(replace(of, delay_std=np.array([delay_std]), echo_delay_std=np.array([echo_delay_std])))
        )
        return float(np.nanmax(budget["scattering"])), float(np.nanmax(budget["boundary_loss"]))

    band = the_band()
    factor = (band.frequency / of.centre) ** 2
    mean = [band.weight[of.snap[0]] @ (factor * np.exp(-((2 * np.pi * band.frequency * s) ** 2))) for s in (0.0, own)]
    smooth, none = terms(0.0, 0.0)
    assert none == 0.0
    scattering, boundary = terms(own, own)
    assert (scattering - smooth, boundary) == pytest.approx((10 * np.log10(mean[1] / mean[0]), 0.0), abs=0.01)
    assert boundary == 0.0
    taken = terms(own, 0.0)
    assert taken == pytest.approx((smooth, smooth - scattering), abs=3e-3)
    total = float(np.hypot(own, others))
    both = terms(total, own)
    assert both[0] == pytest.approx(scattering, abs=3e-3)
    assert both[1] - both[0] == pytest.approx(terms(total, 0.0)[1] - smooth, abs=3e-3)  # however it is divided


def test_one_pulse_twice_is_6_db_louder_where_phases_count_and_3_db_where_not() -> None:
    one = arrivals([0.01], [[1.0, 0.0, 0.0]], [20.0], [0.1])
    one = replace(one, scattering=np.array([0.1]))
    twice = one.select(np.array([0, 0]))
    for of, more in ((replace(twice, coherent=np.ones(2, bool)), 6.0206), (twice, 3.0103)):
        first = levels_of(booked(of.select([0]), 1))["received_level"][0, 0, 0]
        assert levels_of(booked(of, 1))["received_level"][0, 0, 0] - first == pytest.approx(more, abs=1e-6)
    apart = replace(twice, coherent=np.ones(2, bool), delay=np.array([0.01, 0.0153]))
    both = levels_of(booked(apart, 1))["received_level"][0, 0, 0]
    first = levels_of(booked(apart.select([0]), 1))["received_level"][0, 0, 0]
    assert both - first == pytest.approx(3.0103, abs=1e-3)  # they do not overlap in time


def test_opposite_echoes_cancel_and_the_losses_stay() -> None:
    """Two echoes whose phases differ by half a turn, but for 1e-3 rad: 60 dB less of scattering, and of it alone."""
    one = some_paths(1, 3, coherent=True)
    two = one.select(np.array([0, 0]))
    two = replace(two, phase=two.phase + np.array([0.0, np.pi - 1e-3]))
    before, after = levels_of(booked(one)), levels_of(booked(two))
    where = np.nonzero(booked(one).paths)
    for name in ("received_level", "scattering"):
        assert after[name][where] - before[name][where] == pytest.approx(-60.0, abs=1e-3)
    for name in LOSSES:
        assert after[name][where] == pytest.approx(before[name][where])
    none = levels_of(booked(replace(two, phase=np.zeros(2), amplitude=two.amplitude * [1.0, -1.0])))
    assert np.isnan(none["received_level"]).all()


def test_a_facet_may_be_split() -> None:
    """Four triangles of a quarter of the area, delays linear over the facet: the same echo, from facets of any size."""
    for size in (3e-6, 40e-6, 400e-6):
        whole = arrivals([0.01], [[1.0, 0.0, 0.0]], [20.0], [0.1])
        corners = size * np.array([[-0.7, -0.3, 1.0]])
        whole = replace(whole, coherent=np.ones(1, bool), corner_delays=corners, scattering=np.array([0.1]))
        middle = 0.5 * (corners[0] + np.roll(corners[0], 1))
        parts = np.array([middle, *([corners[0, k], middle[k], middle[(k + 1) % 3]] for k in range(3))])
        centre = parts.mean(axis=1)
        four = whole.select(np.zeros(4, int))
        four = replace(
            four,
            amplitude=four.amplitude / 4,
            scattering=four.scattering / 4,
            delay=0.01 + centre,
            corner_delays=parts - centre[:, None],
        )
        received = [levels_of(booked(of, 1))["received_level"][0, 0, 0] for of in (whole, four)]
        assert received[1] == pytest.approx(received[0], abs=2e-3)


def test_the_level_of_coherent_paths_is_the_energy_of_their_signals() -> None:
    """The exact synthesis of a whole family at one hydrophone, over the snap that it was made of."""
    of = some_paths(80, 4, coherent=True, spread=1.5e-3)
    zero = np.zeros(80, np.int64)
    of = replace(of, snap=zero, target=zero, surface=zero, bottom=zero)
    fs, samples = SONAR.sampling_frequency, 4096
    pressure, outside = DirectSum().pressure(of, SNAPS, Reception(POINT, SONAR, absorption, 0.0, samples))
    assert outside == 0
    f, sent = pulse_spectrum(waveform(MODEL), SONAR.antialias, fs, samples)
    inside = (f >= 25e3) & (f <= 85e3)
    heard = np.abs(np.fft.rfft(pressure[0]) / fs)[inside]
    energy = LEVEL[0] + 10 * np.log10((heard**2).sum() / (np.abs(sent[inside]) ** 2).sum())
    assert levels_of(booked(of))["received_level"][0, 0, 0] == pytest.approx(energy, abs=0.03)


def test_the_level_of_what_a_rough_sea_leaves_of_a_sweep_is_that_of_its_spectrum() -> None:
    """Its lower end, at -60 dB, where its energy rises as steeply as blur takes it: slices erred by 0.1 dB, which
    `sonarsynth verify` refused."""
    sonar = Sonar(band=SonarBand(low=20e3, high=32e3), filter=BandPass(low=20e3, high=32e3))
    sweep, blur = waveform(Sweep(start=20.8e3, stop=31.2e3, duration=2e-4)), 2.6e-5
    f, sent = pulse_spectrum(sweep, sonar.antialias, sonar.sampling_frequency, 1 << 18)
    inside = (f >= 20e3) & (f <= 32e3)
    power, middle = np.abs(sent[inside]) ** 2, 20e3 + 12e3 * (np.arange(SLICES) + 0.5) / SLICES
    energy = energy_in_slices(sweep, sonar, SLICES)
    left, exact = (
        of @ np.exp(-((2.0 * np.pi * blur * at) ** 2)) / of.sum() for of, at in ((energy, middle), (power, f[inside]))
    )
    assert 10.0 * np.log10(exact) < -50.0
    assert 10.0 * np.log10(left / exact) == pytest.approx(0.0, abs=0.03)


def test_the_order_of_paths_does_not_matter() -> None:
    of = some_paths(200, 5)
    order = np.random.default_rng(5).permutation(200)
    np.testing.assert_allclose(booked(of.select(order)).level, booked(of).level, atol=1e-9)
    np.testing.assert_allclose(booked(of.select(order)).isolated_level, booked(of).isolated_level, atol=1e-9)


def test_directions_of_echoes_are_means_by_share() -> None:
    """Incoherent echoes by their power; of two coherent ones in phase the louder has its share of the sum."""
    power = np.array([1.0, 0.5])
    of = arrivals([0.01, 0.01], [[1.0, 0.1, 0.0], [1.0, -0.1, 0.05]], [20.0, 20.0], power)
    of = replace(of, scattering=power)
    band = the_band()
    for coherent, share in ((False, power**2), (True, power)):
        some = replace(of, coherent=np.full(2, coherent))
        found = echo_levels(some, path_powers(some, band), 1, LEVEL)
        mean = share @ of.direction
        assert found.azimuth[0, 0] == pytest.approx(np.arctan2(mean[1], mean[0]), rel=1e-6)
        received = levels_of(link_budget(some, path_powers(some, band), band, 1, LEVEL, 0.0))["received_level"][0, 0, 0]
        assert found.level[0, 0] == pytest.approx(received, abs=1e-9)


def test_no_paths_and_no_snaps_are_an_empty_book() -> None:
    of = some_paths(5, 8).select(np.zeros(0, int))
    assert not booked(of).paths.any()
    assert np.isnan(booked(of).level).all()
    assert measured_levels(GriddedSynthesis(), of, SNAPS, SONAR, absorption).shape == (0,)
    band = the_band(0)
    assert link_budget(of, path_powers(of, band), band, 2, np.zeros(0), 0.0).level.shape == (0, 3, 4, len(LINK_BUDGET))
    assert np.isnan(echo_levels(of, path_powers(of, band), 2, np.zeros(0)).level).all()
