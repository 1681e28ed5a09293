"""Arrays focused in parts against sums in float64, and their error model against images with the delays of a sphere."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.conventions import direction
from sonarsynth.equations.arrays.apertures import focus_delay
from sonarsynth.imaging import AutoBeamforming, DenseDelayAndSum, FocusedDelayAndSum
from sonarsynth.imaging.delay_and_sum.dense import dense_energies
from sonarsynth.imaging.delay_and_sum.focus_error import PARTS, focus_error, parts_needed
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


def image(array, beams, focus, parts, spectra, frequencies):
    weight = uniform(array)
    if parts == 0:
        return focused_energies(spectra, array, weight, frequencies, beams.azimuth, beams.elevation, SPEED, focus)
    cut = steered_zones(array, "uniform", beams, focus, SPEED, BAND, parts)
    return zoned_energies(spectra, array, weight, frequencies, beams, SPEED, cut)


def applied(array, beams, focus, parts):
    """Delays (elevation, azimuth, sensor) that each beam takes by the zones' own account, one beam at a time."""
    glass = lens(array, focus, SPEED, parts)
    delay = np.full((beams.elevations, beams.azimuths, array.count), np.nan)
    for zone in zones_of(glass, for_sensors(array, uniform(array), BAND), beams, parts):
        for row in range(zone.low, zone.high):
            for column in range(zone.near, zone.far):
                u = quadrant(beams)[row, column]
                for up in (-1, 1):
                    for port in (-1, 1):
                        i = beams.elevations // 2 + row if up > 0 else (beams.elevations - 1) // 2 - row
                        j = beams.azimuths // 2 + column if port > 0 else (beams.azimuths - 1) // 2 - column
                        y, z = port * array.position[:, 1], up * array.position[:, 2]
                        left_out = zone.left_out(glass, y, z, u[None])[0]
                        towards = direction(beams.azimuth[j], beams.elevation[i])
                        delay[i, j] = focus_delay(array.position, towards, focus, SPEED) - left_out
    return delay


@pytest.mark.parametrize("parts", [1, 2, 3, 4])
@pytest.mark.parametrize(
    ("array", "beams"),
    [
        (Romanis(dead=(0, 77)), BeamGrid(azimuths=13, elevations=8)),
        (PlanarLattice(columns=7, rows=5, pitch=0.05), BeamGrid(azimuths=6, elevations=9)),
        (PlanarLattice(columns=9, rows=1, pitch=0.05), BeamGrid(azimuths=7, elevations=1)),
        (PlanarLattice(columns=1, rows=4, pitch=0.05), BeamGrid(azimuths=1, elevations=6)),
    ],
)
def test_kernel_equals_sums_with_the_delays_that_the_zones_state(array, beams, parts):
    array = elements(array)
    random = np.random.default_rng(parts)
    spectra = random.normal(size=(array.count, 70)) + 1j * random.normal(size=(array.count, 70))
    frequencies = 25e3 + 800.0 * np.arange(70)
    fast = image(array, beams, 4.0, parts, spectra.astype(np.complex64), frequencies)
    delay = applied(array, beams, 4.0, parts).reshape(-1, array.count)
    exact = dense_energies(spectra, delay, uniform(array), frequencies).reshape(fast.shape)
    np.testing.assert_allclose(fast, exact, atol=2e-6 * exact.max())


def test_parts_of_one_hydrophone_leave_nothing_out():
    """Then every beam has the delays of a sphere to each: the image is that of the exact sum."""
    array, beams = elements(PlanarLattice(columns=5, rows=3, pitch=0.2)), grid(50, 13)
    np.testing.assert_allclose(
        applied(array, beams, 2.0, 5),
        focus_delay(array.position, direction(beams.azimuth, beams.elevation[:, None]).reshape(-1, 3), 2.0, SPEED)
        .reshape(beams.elevations, beams.azimuths, -1),
        atol=1e-12,
    )  # fmt: skip


@pytest.mark.parametrize("array", [ROMANIS, RECTANGLE])
@pytest.mark.parametrize(("span", "focus", "parts"), [
    (50, 20.0, 0), (50, 20.0, 1), (50, 5.0, 1), (50, 5.0, 3), (50, 10.0, 2), (50, 2.0, 5), (20, 50.0, 0), (20, 5.0, 1),
    (20, 2.0, 2),
])  # fmt: skip
def test_error_model_is_not_below_the_error_of_these_images_within_20_db_of_their_peak(array, span, focus, parts):
    """Sources at the focus in the worst beams of the model and in beams drawn at random; and the loss at the peak.

    The constants of the model were chosen on these arrays and views: this guards them, and says nothing of others.
    """
    array, beams = elements(array), grid(span, 31)
    weight, glass = uniform(array), lens(array, focus, SPEED, parts)
    moments = for_sensors(array, weight, BAND)
    u = quadrant(beams)
    tried = [
        (z.estimate(glass, moments, u[at][None]), at)
        for z in zones_of(glass, moments, beams, parts)
        for at in corners(z)
    ]
    worst = [at for _, at in sorted(tried, reverse=True)[:2]]
    sources = [(beams.elevations // 2 + row, beams.azimuths // 2 + column) for row, column in worst]
    sources.append((sources[0][0], beams.azimuths - 1 - sources[0][1]))
    sources += [tuple(s) for s in np.random.default_rng(1).integers(0, [beams.elevations, beams.azimuths], (2, 2))]
    towards = direction(beams.azimuth, beams.elevation[:, None])
    delay = focus_delay(array.position, towards.reshape(-1, 3), focus, SPEED)
    error = lost = 0.0
    for source in sources:
        arrival = focus_delay(array.position, towards[source], focus, SPEED)
        spectra = np.exp(-2j * np.pi * FREQUENCIES * arrival[:, None]).astype(np.complex64)
        exact = dense_energies(spectra, delay, weight, FREQUENCIES).reshape(towards.shape[:2])
        decibels = 10.0 * np.log10(image(array, beams, focus, parts, spectra, FREQUENCIES) / exact)
        error = max(error, np.abs(decibels[exact >= 0.01 * exact.max()]).max())
        lost = max(lost, -decibels[source])
    bound = focus_error(array, weight, beams, SPEED, focus, BAND, parts)
    assert 0.9 * error <= bound <= 6.0 * error + 1e-3
    peak = focus_error(array, weight, beams, SPEED, focus, BAND, parts, within=0.0)
    assert 0.9 * lost - 2e-4 <= peak <= bound


def test_error_falls_with_parts_and_with_distance():
    array, beams = elements(ROMANIS), grid(50, 31)
    by_parts = [focus_error(array, uniform(array), beams, SPEED, 10.0, BAND, n) for n in PARTS[:6]]
    by_focus = [focus_error(array, uniform(array), beams, SPEED, r, BAND, 2) for r in (2.0, 5.0, 10.0, 20.0, 50.0)]
    assert all(np.diff(by_parts) < 0)
    assert all(np.diff(by_focus) < 0)
    assert focus_error(array, uniform(array), beams, SPEED, None, BAND, 0) == 0.0


def test_as_many_parts_as_are_needed_and_no_more():
    array, sonar = elements(RECTANGLE), Sonar(array=RECTANGLE, beams=grid(50, 31))
    beams, speed, band = sonar.beams, sonar.assumed_sound_speed, sonar.band
    few = parts_needed(array, "uniform", sonar, 5.0, 0.5)
    assert few is not None and few > 0
    errors = [
        focus_error(array, uniform(array), beams, speed, 5.0, band, n) for n in (few, PARTS[PARTS.index(few) - 1])
    ]
    assert errors[0] <= 0.5 < errors[1]
    assert parts_needed(array, "uniform", sonar, 5.0, 100.0) == 0
    assert parts_needed(array, "uniform", sonar, 5.0, 0.0) is None


def heard(array, source, rate=196e3):
    delay = (np.linalg.norm(source - array.position, axis=1) - np.linalg.norm(source)) / SPEED
    t = np.arange(1000) / rate - 2.5e-3 - delay[:, None]
    pressure = np.exp(-0.5 * (2 * np.pi * 7e3 * t) ** 2) * np.cos(2 * np.pi * 55e3 * t)
    return Signals(pressure.astype(np.float32), 0.0, rate, 0.0, 0, 0)


def test_auto_is_right_to_a_tenth_of_a_decibel_where_the_axis_is_not():
    sonar = Sonar(array=RECTANGLE, beams=grid(50, 31))
    array = elements(RECTANGLE)
    signals = heard(array, 5.0 * direction(sonar.beams.azimuth[30], sonar.beams.elevation[24]))
    window = (0.001, 0.004)
    dense = DenseDelayAndSum(focus=5.0).image(signals, array, sonar, *window).energy
    bright = dense >= 0.01 * dense.max()

    def error(method):
        return np.abs(10 * np.log10(method.image(signals, array, sonar, *window).energy / dense))[bright].max()

    assert error(FocusedDelayAndSum(focus=5.0, parts=0)) > 0.5
    assert error(FocusedDelayAndSum(focus=5.0)) < 0.1
    assert error(AutoBeamforming(focus=5.0)) < 0.1


def test_auto_is_dense_where_parts_will_not_do_and_focused_elsewhere():
    sonar, array = Sonar(array=RECTANGLE, beams=grid(50, 31)), elements(RECTANGLE)
    assert AutoBeamforming(focus=None).estimated(array, sonar, 0.1) == FocusedDelayAndSum(focus=None, parts=0)
    near = AutoBeamforming(focus=5.0, shading="hann").estimated(array, sonar, 0.5)
    assert isinstance(near, FocusedDelayAndSum)
    assert (near.shading, near.focus) == ("hann", 5.0)
    assert near.parts != "auto" and near.parts > 0
    assert AutoBeamforming(focus=5.0).estimated(array, sonar, 1e-9) == DenseDelayAndSum(focus=5.0)
    table = elements(PositionTable(positions=((0.0, 0.0, 0.0), (0.0, 0.1, 0.03))))
    assert AutoBeamforming().estimated(table, sonar, 0.1) == DenseDelayAndSum()


@pytest.mark.parametrize("parts", [-1, 17, "some"])
def test_parts_are_none_to_16_or_auto(parts):
    with pytest.raises(ValueError, match="parts"):
        FocusedDelayAndSum(parts=parts)
