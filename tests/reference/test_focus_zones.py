"""Focus zones against sums in float64, and their error model against images with the delays of a sphere."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.conventions import direction
from sonarsynth.equations.arrays.apertures import focus_delay
from sonarsynth.imaging import AutoBeamforming, DenseDelayAndSum, FocusedDelayAndSum
from sonarsynth.imaging.delay_and_sum.dense import dense_energies
from sonarsynth.imaging.delay_and_sum.focus_error import focus_error, zones_for
from sonarsynth.imaging.delay_and_sum.lattice_image import focused_energies, steered_zones, zoned_energies
from sonarsynth.imaging.delay_and_sum.zones import corners, for_sensors, lens, quadrant, zones_of
from sonarsynth.products import Signals
from sonarsynth.receiver import Band, BeamGrid, PlanarLattice, PositionTable, Romanis, Sonar, elements

SPEED = 1540.0
BAND = Band(low=25e3, high=85e3)
FREQUENCIES = np.linspace(25e3, 85e3, 61)
ROMANIS = Romanis(dead=(3, 200, 201, 202))
RECTANGLE = PlanarLattice(columns=20, rows=8, pitch=0.04)


def uniform(parts):
    return parts.gain / parts.gain.sum()


def grid(span, count):
    return BeamGrid(
        azimuth_span=np.deg2rad(span),
        azimuths=count,
        elevation_span=np.deg2rad(0.8 * span),
        elevations=count - 6,
    )


def image(parts, beams, focus, zones, spectra, frequencies):
    weight = uniform(parts)
    if zones == 1:
        return focused_energies(spectra, parts, weight, frequencies, beams.azimuth, beams.elevation, SPEED, focus)
    cut = steered_zones(parts, "uniform", beams, focus, SPEED, BAND, zones)
    return zoned_energies(spectra, parts, weight, frequencies, beams, SPEED, cut)


def applied(parts, beams, focus, zones):
    """Delays (elevation, azimuth, sensor) that each beam takes by the zones' own account, one beam at a time."""
    glass = lens(parts, focus, SPEED)
    delay = np.full((beams.elevations, beams.azimuths, parts.count), np.nan)
    for zone in zones_of(glass, for_sensors(parts, uniform(parts), BAND), beams, zones):
        for row in range(zone.low, zone.high):
            for column in range(zone.near, zone.far):
                u = quadrant(beams)[row, column]
                for up in (-1, 1):
                    for port in (-1, 1):
                        i = beams.elevations // 2 + row if up > 0 else (beams.elevations - 1) // 2 - row
                        j = beams.azimuths // 2 + column if port > 0 else (beams.azimuths - 1) // 2 - column
                        y, z = port * parts.position[:, 1], up * parts.position[:, 2]
                        left_out = zone.left_out(glass, y, z, u[None])[0]
                        towards = direction(beams.azimuth[j], beams.elevation[i])
                        delay[i, j] = focus_delay(parts.position, towards, focus, SPEED) - left_out
    return delay


@pytest.mark.parametrize("zones", [2, 3, 32])
@pytest.mark.parametrize(
    ("array", "beams"),
    [
        (Romanis(dead=(0, 77)), BeamGrid(azimuths=13, elevations=8)),
        (PlanarLattice(columns=7, rows=5, pitch=0.05), BeamGrid(azimuths=6, elevations=9)),
        (PlanarLattice(columns=9, rows=1, pitch=0.05), BeamGrid(azimuths=7, elevations=1)),
        (PlanarLattice(columns=1, rows=4, pitch=0.05), BeamGrid(azimuths=1, elevations=6)),
    ],
)
def test_kernel_equals_sums_with_the_delays_that_the_zones_state(array, beams, zones):
    parts = elements(array)
    random = np.random.default_rng(zones)
    spectra = random.normal(size=(parts.count, 70)) + 1j * random.normal(size=(parts.count, 70))
    frequencies = 25e3 + 800.0 * np.arange(70)
    fast = image(parts, beams, 4.0, zones, spectra.astype(np.complex64), frequencies)
    delay = applied(parts, beams, 4.0, zones).reshape(-1, parts.count)
    exact = dense_energies(spectra, delay, uniform(parts), frequencies).reshape(fast.shape)
    np.testing.assert_allclose(fast, exact, atol=2e-6 * exact.max())


@pytest.mark.parametrize("array", [ROMANIS, RECTANGLE])
@pytest.mark.parametrize(("span", "focus", "zones"), [
    (50, 20.0, 1), (50, 20.0, 4), (50, 5.0, 2), (50, 5.0, 8), (50, 10.0, 6), (50, 2.0, 10), (20, 50.0, 1),
    (20, 5.0, 3), (20, 2.0, 4),
])  # fmt: skip
def test_error_model_is_not_below_the_error_of_these_images_within_20_db_of_their_peak(array, span, focus, zones):
    """Sources at the focus in the worst beams of the model and in beams drawn at random; and the loss at the peak.

    The constants of the model were chosen on these arrays and views: this guards them, and says nothing of others.
    """
    parts, beams = elements(array), grid(span, 31)
    weight, glass = uniform(parts), lens(parts, focus, SPEED)
    heard = for_sensors(parts, weight, BAND)
    u = quadrant(beams)
    tried = [
        (z.estimate(glass, heard, u[at][None]), at) for z in zones_of(glass, heard, beams, zones) for at in corners(z)
    ]
    worst = [at for _, at in sorted(tried, reverse=True)[:2]]
    sources = [(beams.elevations // 2 + row, beams.azimuths // 2 + column) for row, column in worst]
    sources.append((sources[0][0], beams.azimuths - 1 - sources[0][1]))
    sources += [tuple(s) for s in np.random.default_rng(1).integers(0, [beams.elevations, beams.azimuths], (2, 2))]
    towards = direction(beams.azimuth, beams.elevation[:, None])
    delay = focus_delay(parts.position, towards.reshape(-1, 3), focus, SPEED)
    found = lost = 0.0
    for source in sources:
        arrival = focus_delay(parts.position, towards[source], focus, SPEED)
        spectra = np.exp(-2j * np.pi * FREQUENCIES * arrival[:, None]).astype(np.complex64)
        exact = dense_energies(spectra, delay, weight, FREQUENCIES).reshape(towards.shape[:2])
        decibels = 10.0 * np.log10(image(parts, beams, focus, zones, spectra, FREQUENCIES) / exact)
        found = max(found, np.abs(decibels[exact >= 0.01 * exact.max()]).max())
        lost = max(lost, -decibels[source])
    bound = focus_error(parts, weight, beams, SPEED, focus, BAND, zones)
    assert 0.9 * found <= bound <= 6.0 * found + 1e-3
    peak = focus_error(parts, weight, beams, SPEED, focus, BAND, zones, within=0.0)
    assert 0.9 * lost - 2e-4 <= peak <= bound


def test_error_falls_with_zones_and_with_distance():
    parts, beams = elements(ROMANIS), grid(50, 31)
    by_zones = [focus_error(parts, uniform(parts), beams, SPEED, 10.0, BAND, n) for n in (1, 2, 4, 8, 16)]
    by_focus = [focus_error(parts, uniform(parts), beams, SPEED, r, BAND, 4) for r in (2.0, 5.0, 10.0, 20.0, 50.0)]
    assert all(np.diff(by_zones) < 0)
    assert all(np.diff(by_focus) < 0)
    assert focus_error(parts, uniform(parts), beams, SPEED, None, BAND, 1) == 0.0


def test_zones_for_meets_its_tolerance_and_no_fewer_do():
    parts, beams = elements(RECTANGLE), grid(50, 31)
    arguments = (parts, uniform(parts), beams, SPEED, 5.0, BAND)
    few = zones_for(*arguments, 0.5)
    assert few is not None and few > 1
    assert focus_error(*arguments, few) <= 0.5 < focus_error(*arguments, few - 1)
    assert zones_for(*arguments, 100.0) == 1
    assert zones_for(*arguments, 0.0) is None


def heard(parts, source, rate=196e3):
    delay = (np.linalg.norm(source - parts.position, axis=1) - np.linalg.norm(source)) / SPEED
    t = np.arange(1000) / rate - 2.5e-3 - delay[:, None]
    pressure = np.exp(-0.5 * (2 * np.pi * 7e3 * t) ** 2) * np.cos(2 * np.pi * 55e3 * t)
    return Signals(pressure.astype(np.float32), 0.0, rate, 0.0, 0, 0)


def test_auto_is_right_to_a_tenth_of_a_decibel_where_one_zone_is_not():
    sonar = Sonar(array=RECTANGLE, beams=grid(50, 31))
    parts = elements(RECTANGLE)
    signals = heard(parts, 5.0 * direction(sonar.beams.azimuth[30], sonar.beams.elevation[24]))
    window = (0.001, 0.004)
    dense = DenseDelayAndSum(focus=5.0).image(signals, parts, sonar, *window).energy
    bright = dense >= 0.01 * dense.max()

    def error(method):
        return np.abs(10 * np.log10(method.image(signals, parts, sonar, *window).energy / dense))[bright].max()

    assert error(FocusedDelayAndSum(focus=5.0, zones=1)) > 0.5
    assert error(FocusedDelayAndSum(focus=5.0)) < 0.1
    assert error(AutoBeamforming(focus=5.0)) < 0.1


def test_auto_is_dense_where_zones_will_not_do_and_focused_elsewhere():
    sonar, parts = Sonar(array=RECTANGLE, beams=grid(50, 31)), elements(RECTANGLE)
    assert AutoBeamforming(focus=None).estimated(parts, sonar, 0.1) == FocusedDelayAndSum(focus=None, zones=1)
    near = AutoBeamforming(focus=5.0, shading="hann").estimated(parts, sonar, 0.5)
    assert isinstance(near, FocusedDelayAndSum)
    assert (near.shading, near.focus) == ("hann", 5.0)
    assert near.zones != "auto" and near.zones > 1
    assert AutoBeamforming(focus=5.0).estimated(parts, sonar, 1e-9) == DenseDelayAndSum(focus=5.0)
    table = elements(PositionTable(positions=((0.0, 0.0, 0.0), (0.0, 0.1, 0.03))))
    assert AutoBeamforming().estimated(table, sonar, 0.1) == DenseDelayAndSum()


@pytest.mark.parametrize("zones", [0, 33, "some"])
def test_zones_are_one_to_32_or_auto(zones):
    with pytest.raises(ValueError, match="zones"):
        FocusedDelayAndSum(zones=zones)
