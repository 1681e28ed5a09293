"""Baseline detectors: what they find in images that are known, and how often in noise alone."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.detection import CellAveraging, ImagePeaks, SonarView, detections_of

AZIMUTH, ELEVATION = np.linspace(-20.0, 20.0, 81), np.linspace(-15.0, 15.0, 61)
WIDTH = np.array([3.0, 3.0])
"""deg, between beams of 0.5."""


def view(
    *spots: tuple[float, float, float], noise: float = 1e-4, points: object = (), width: np.ndarray = WIDTH
) -> SonarView:
    """Points seen by beams that are Gaussian, half as bright half a width off: azimuth, elevation (deg), energy."""
    energy = np.full((61, 81), noise)
    for azimuth, elevation, loud in spots:
        away = ((AZIMUTH - azimuth) / width[0]) ** 2 + ((ELEVATION[:, None] - elevation) / width[1]) ** 2
        energy += loud * np.exp2(-away / 0.5**2)
    return SonarView(energy, AZIMUTH, ELEVATION, width, np.reshape(np.array(points, float), (-1, 4)))


@pytest.mark.parametrize("method", [ImagePeaks(), CellAveraging(guard=1.5)], ids=["peaks", "cfar"])
def test_each_spot_is_found_where_it_is_with_its_range(method: ImagePeaks | CellAveraging) -> None:
    points = [(10.0, 5.0, 12.0, 1.0), (10.5, 5.0, 14.0, 0.1), (-8.0, -6.0, 20.0, 1.0), (0.0, 0.0, 3.0, 9.0)]
    seen = view((10.0, 5.0, 1.0), (-8.0, -6.0, 0.5), points=points)
    found = sorted(detections_of(seen, method), key=lambda one: -one["score"])
    assert len(found) == 2
    for one, (azimuth, elevation, away) in zip(
        sorted(found, key=lambda one: -one["azimuth"]), [(10.0, 5.0, 12.0), (-8.0, -6.0, 20.0)], strict=True
    ):
        assert one["azimuth"] == pytest.approx(azimuth, abs=0.3) and one["elevation"] == pytest.approx(
            elevation, abs=0.3
        )
        assert one["range"] == away
        x, y = np.interp(azimuth, AZIMUTH, np.arange(81) + 0.5), np.interp(elevation, ELEVATION, np.arange(61) + 0.5)
        assert one["box"][0] <= x <= one["box"][2] and one["box"][1] <= y <= one["box"][3]


def test_the_box_of_a_point_is_one_beam_and_that_of_a_line_is_as_long() -> None:
    seen = view((0.0, 0.0, 1.0))
    (point,) = detections_of(seen, ImagePeaks())
    assert point["box"][2] - point["box"][0] <= 2.0
    seen = view(*((azimuth, 0.0, 1.0) for azimuth in np.arange(-6.0, 6.1, 0.5)))
    (line,) = detections_of(seen, ImagePeaks())
    x0, y0, x1, y1 = line["box"]
    assert x1 - x0 == pytest.approx(12.0 / 0.5, abs=2.0) and y1 - y0 <= 2.0


@pytest.mark.parametrize("method", [ImagePeaks(), CellAveraging(guard=1.5)], ids=["peaks", "cfar"])
def test_beams_wide_one_way_are_told_from_objects_that_are(method: ImagePeaks | CellAveraging) -> None:
    """Of a long array: two points beside each other across its narrow beams are two, a point is small both ways."""
    seen = view((-4.0, 0.0, 1.0), (4.0, 0.0, 0.8), width=np.array([2.0, 10.0]))
    found = detections_of(seen, method)
    assert len(found) == 2
    if method.kind == "peaks":  # whose regions are half-power ones
        for one in found:
            assert one["box"][2] - one["box"][0] <= 2.0 and one["box"][3] - one["box"][1] <= 6.0  # of beams 20 high


def test_what_is_found_turns_with_the_image_and_scales_with_its_grid() -> None:
    seen = view((-4.0, 3.0, 1.0), (5.0, -6.0, 0.8), width=np.array([2.0, 7.0]))
    turned = SonarView(seen.energy.T, ELEVATION, AZIMUTH, seen.beam_width[::-1], seen.points)
    coarse = SonarView(seen.energy, AZIMUTH, 4.0 * ELEVATION, seen.beam_width * [1.0, 4.0], seen.points)
    for method in (ImagePeaks(), CellAveraging()):
        one, other, third = (
            sorted((r.score, *map(tuple, sides)) for r in method.regions(v) for sides in [(r.rows, r.columns)[::way]])
            for v, way in ((seen, 1), (turned, -1), (coarse, 1))
        )
        assert len(one) == len(other) >= 2 and one == third
        for (score, rows, columns), (same, across, up) in zip(one, other, strict=True):
            assert score == pytest.approx(same) and set(zip(rows, columns, strict=True)) == set(
                zip(across, up, strict=True)
            )


def test_a_spot_that_is_too_faint_beside_the_brightest_is_a_side_lobe() -> None:
    seen = view((10.0, 0.0, 1.0), (-10.0, 0.0, 0.02))
    assert len(ImagePeaks().regions(seen)) == 1
    assert len(ImagePeaks(dynamic_range=20.0).regions(seen)) == 2


def test_scores_are_levels_over_the_median_whatever_the_unit() -> None:
    seen = view((3.0, 3.0, 1.0))
    louder = SonarView(1e6 * seen.energy, AZIMUTH, ELEVATION, WIDTH, seen.points)
    for method in (ImagePeaks(), CellAveraging()):
        one, other = method.regions(seen), method.regions(louder)
        assert [r.score for r in one] == pytest.approx([r.score for r in other])
    (peak,) = ImagePeaks().regions(seen)
    assert peak.score == pytest.approx(10.0 * np.log10((1.0 + 1e-4) / np.median(seen.energy)), abs=1e-6)


@pytest.mark.parametrize("rate", [0.1, 0.01])
def test_noise_passes_as_often_as_cfar_says(rate: float) -> None:
    """Independent exponential energies, for which the factor is exact."""
    random = np.random.default_rng(5)
    method, cells, passed = CellAveraging(false_alarm_rate=rate), 0, 0
    for _ in range(40):
        seen = SonarView(random.exponential(size=(61, 81)), AZIMUTH, ELEVATION, WIDTH, np.zeros((0, 4)))
        passed += sum(len(region.rows) for region in method.regions(seen))
        cells += seen.energy.size
    assert passed / cells == pytest.approx(rate, rel=0.05 if rate > 0.05 else 0.15)


def test_beams_without_energy_are_nothing() -> None:
    seen = view((10.0, 5.0, 1.0))
    holes = seen.energy.copy()
    holes[:, :20] = np.nan
    cut = SonarView(holes.copy(), AZIMUTH, ELEVATION, WIDTH, seen.points)
    holes[:, :60] = np.nan
    most = SonarView(holes, AZIMUTH, ELEVATION, WIDTH, seen.points)  # the spot is in the other quarter
    for method in (ImagePeaks(), CellAveraging()):
        assert len(method.regions(cut)) == len(method.regions(most)) == len(method.regions(seen)) == 1
        assert method.regions(SonarView(np.full((61, 81), np.nan), AZIMUTH, ELEVATION, WIDTH, seen.points)) == []
