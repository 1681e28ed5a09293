"""Pictures show what is there: outlines against closed forms, port on the left, the filter's edge at its cutoff."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.equations.bubble.pulses import filtered
from sonarsynth.equations.noise.filters import Fir
from sonarsynth.pictures.figures.frame_figure import FramePicture, Hull, View, darkest
from sonarsynth.pictures.figures.outlines import CELLS, union_outline, view_outline
from sonarsynth.pictures.figures.snap_comparison import compare_snaps
from sonarsynth.pictures.figures.snap_figure import bandwidth, half_width, snap_figure
from sonarsynth.pictures.figures.style import DYNAMIC_RANGE, pixels
from sonarsynth.pictures.ray_figures.ray_figure import section_figure, space_figure
from sonarsynth.pictures.ray_figures.ray_styles import Look
from sonarsynth.pictures.ray_figures.scene_geometry import SceneGeometry
from sonarsynth.receiver import PlanarLattice, elements
from sonarsynth.sources.recordings import Recording
from sonarsynth.sources.shrimp import LogarithmicBubble

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
SQUARE_FACES = np.array([[0, 1, 2], [0, 2, 3]])


def sphere(centre: list[float], radius: float = 0.5) -> tuple[np.ndarray, np.ndarray]:
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    return np.asarray(ball.vertices) + centre, np.asarray(ball.faces)


def enclosed(line: np.ndarray) -> float:
    """Area inside a closed line (shoelace formula)."""
    x, y = line.T
    return 0.5 * abs(float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])))


def test_the_outline_of_a_square_is_the_square() -> None:
    (line,) = union_outline(SQUARE, SQUARE_FACES)
    assert np.abs(np.abs(line - 0.5).max(axis=1) - 0.5).max() < 1.0 / CELLS
    assert np.allclose(line[0], line[-1])
    assert enclosed(line) == pytest.approx(1.0, rel=4.0 / CELLS)


def test_the_outline_does_not_depend_on_how_a_shape_is_cut() -> None:
    middle = np.vstack([SQUARE, [[0.3, 0.6]]])
    other = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    (one,), (two,) = union_outline(SQUARE, SQUARE_FACES), union_outline(middle, other)
    assert enclosed(one) == pytest.approx(enclosed(two), rel=1e-9)


def test_a_hole_stays_a_hole() -> None:
    angle = np.linspace(0, 2 * np.pi, 65)[:-1]
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    i = np.arange(64)
    j = (i + 1) % 64
    faces = np.concatenate([np.stack([i, j, i + 64], 1), np.stack([j, j + 64, i + 64], 1)])
    lines = union_outline(np.vstack([ring, 0.5 * ring]), faces)
    assert sorted(enclosed(line) for line in lines) == pytest.approx([np.pi / 4, np.pi], rel=0.02)


@pytest.mark.parametrize("distance", [0.6, 3.0, 500.0])
def test_a_sphere_is_seen_at_the_angle_whose_sine_is_radius_over_distance(distance: float) -> None:
    (line,) = view_outline(*sphere([distance, 0.0, 0.0]))
    off_axis = np.arccos(np.cos(line[:, 0]) * np.cos(line[:, 1]))
    expected = np.arcsin(0.5 / distance)
    assert np.abs(off_axis / expected - 1.0).max() < 0.012


@pytest.mark.parametrize(("y", "z"), [(2.0, 1.0), (-2.0, 1.0), (2.0, -1.0), (-2.0, -1.0)])
def test_port_is_positive_azimuth_and_up_positive_elevation(y: float, z: float) -> None:
    (line,) = view_outline(*sphere([10.0, y, z]))
    assert np.sign(line.mean(axis=0)).tolist() == [np.sign(y), np.sign(z)]
    assert line.mean(axis=0) == pytest.approx([np.arctan2(y, 10.0), np.arctan2(z, np.hypot(10.0, y))], abs=2e-3)


def test_what_is_behind_the_sonar_has_no_outline() -> None:
    assert view_outline(*sphere([-5.0, 0.0, 0.0])) == []
    assert view_outline(np.full((3, 3), np.nan), [[0, 1, 2]]) == []
    assert view_outline(np.ones((3, 3)), [[0, 1, 2]]) == []  # a point


def test_a_bright_beam_to_port_and_up_is_drawn_to_the_left_and_up() -> None:
    azimuth, elevation = np.linspace(-25.0, 25.0, 21), np.linspace(-20.0, 20.0, 17)
    level = np.full((17, 21), -np.inf)
    level[15, 19] = 0.0  # elevation 17.5, azimuth 22.5
    view = View(title="", level=level, points=np.zeros((0, 3)), point_level=np.zeros(0), hulls=())
    picture = FramePicture(azimuth, elevation, [view], "dB")
    picture.show(view)
    shot = pixels(picture.figure)[..., :3].astype(int)
    axes = picture.figure.axes[0]
    height = shot.shape[0]
    x, y = axes.transData.transform((22.5, 17.5))
    left, bottom = axes.transData.transform((0.0, 0.0))
    assert x < left
    assert y > bottom
    assert shot[round(height - y), round(x)].sum() > 600  # the bright end of the map
    x, y = axes.transData.transform((-22.5, -17.5))
    assert shot[round(height - y), round(x)].sum() < 60


def test_the_cloud_from_above_has_port_on_the_left_and_counts_what_it_does_not_show() -> None:
    points = np.array([[10.0, 0.5, 0.0], [10.0, -0.5, 0.0], [50.0, 0.0, 0.0]])
    hull = Hull("ball", *sphere([10.0, 0.0, 0.0]))
    view = View(title="", level=None, points=points, point_level=np.zeros(3), hulls=(hull,))
    picture = FramePicture(np.linspace(-5, 5, 5), np.linspace(-5, 5, 5), [view], "dB")
    picture.show(view)
    plan = next(axes for axes in picture.figure.axes if "above" in axes.get_title(loc="left"))
    assert plan.xaxis_inverted()
    assert not plan.yaxis_inverted()
    assert "3 points (1 outside)" in [text.get_text() for text in plan.texts]


def test_the_filter_is_drawn_with_half_its_response_at_the_cutoff() -> None:
    b = LogarithmicBubble()
    drawn = snap_figure(lambda highest: b.pulse(0.0, highest), Fir(0.0, 110e3, 10e3, 80.0), source_level=190.0)
    waveform, levels, response = drawn.axes
    frequency, decibels = response.lines[0].get_data()
    assert np.interp(110.0, frequency, decibels) == pytest.approx(-6.02, abs=0.05)
    assert waveform.lines[0].get_ydata().max() == pytest.approx(1e-3 * 10 ** (190 / 20) * 1e-6, rel=0.02)
    assert waveform.get_ylabel() == "pressure at 1 m (kPa)"
    assert waveform.get_xlim()[0] >= -110.0 and waveform.get_xlim()[1] <= 110.0  # us
    assert "snap: peak 190.0 dB" in waveform.get_legend().get_texts()[0].get_text()
    both = [line.get_ydata() for line in levels.lines]
    assert np.allclose(both[1] - both[0], decibels, atol=1e-6)


@pytest.mark.parametrize(("level", "peak", "unit"), [(179.0, 891.0, "Pa"), (121.0, 1.122, "Pa"), (61.0, 1.122, "mPa")])
def test_a_snap_is_drawn_in_a_unit_of_its_size(level: float, peak: float, unit: str) -> None:
    """1 Pa is 120 dB re 1 uPa."""
    b = LogarithmicBubble()
    (waveform, *_) = snap_figure(lambda highest: b.pulse(0.0, highest), Fir(0.0, 110e3, 10e3, 80.0), level).axes
    assert waveform.lines[0].get_ydata().max() == pytest.approx(peak, rel=0.02)
    assert waveform.get_ylabel() == f"pressure at 1 m ({unit})"


def test_width_and_bandwidth_of_a_tone_in_a_gaussian_are_those_of_the_closed_form() -> None:
    """exp(-t^2/2 s^2): 2 sqrt(2 ln 2) s wide at half its height, and in the spectrum sqrt(ln 10)/(2 pi s) either side
    at -10 dB."""
    s = 8e-6
    time, frequency = np.linspace(-1e-4, 1e-4, 40_001), np.linspace(0.0, 2e5, 20_001)
    assert half_width(time, -np.exp(-0.5 * (time / s) ** 2)) == pytest.approx(2 * np.sqrt(2 * np.log(2)) * s, rel=1e-6)
    level = 20 * np.log10(np.exp(-0.5 * (2 * np.pi * s * (frequency - 9e4)) ** 2))
    half = np.sqrt(np.log(10)) / (2 * np.pi * s)
    assert bandwidth(frequency, level) == pytest.approx((9e4 - half, 9e4 + half), abs=10.0)


def snap_recording(rate: float, noise: float = 0.0, sign: float = 1.0) -> Recording:
    """A snap as a hydrophone of some sampling frequency has it, with noise (rms, over its peak), between samples."""
    time = (np.arange(600) - 400.37) / rate
    p = filtered(time, LogarithmicBubble().pulse(0.0, 1.2 * rate), Fir(0.0, 0.4 * rate, 0.1 * rate, 80.0))
    p = sign * p / np.abs(p).max() + noise * np.random.default_rng(5).standard_normal(len(p))
    return Recording(p * np.hanning(1200)[300:900], rate, float(np.argmax(np.abs(p))))


def test_a_recording_of_the_model_itself_is_found_to_be_it() -> None:
    bubble = LogarithmicBubble()
    for sign in (1.0, -1.0):
        window = snap_recording(1e6, sign=sign)
        found = compare_snaps(lambda highest: bubble.pulse(0.0, highest), window, (25e3, 85e3))
        assert found.misfit < 0.03 and found.level_misfit < 0.1
        assert found.inverted == (sign < 0.0)


def test_the_misfit_is_the_noise_of_the_recording() -> None:
    """And the model fits best as it is placed: an rms misfit of sin(angle) between the two as vectors."""
    bubble = LogarithmicBubble()
    clean, noisy = (
        compare_snaps(lambda highest: bubble.pulse(0.0, highest), snap_recording(1e6, noise), (25e3, 85e3))
        for noise in (0.0, 0.05)
    )
    share = 0.05 * np.sqrt(0.85) / np.sqrt(np.mean(clean.measured**2))  # the low pass lets 0.85 of the noise through
    assert noisy.misfit == pytest.approx(share, rel=0.2)
    cosine = noisy.measured @ noisy.modelled / np.linalg.norm(noisy.measured) / np.linalg.norm(noisy.modelled)
    assert noisy.misfit == pytest.approx(np.sqrt(1.0 - cosine**2), rel=1e-9)


def test_a_recording_below_the_band_of_the_sonar_is_refused() -> None:
    with pytest.raises(ValueError, match="sampled at 40000 Hz: it has nothing of the sonar's band"):
        compare_snaps(lambda highest: LogarithmicBubble().pulse(0.0, highest), snap_recording(4e4), (25e3, 85e3))


def around(bottom: float, *hulls: Hull) -> SceneGeometry:
    """An array at (0, 0, -0.1) that looks along x; its field of view is 2 m across."""
    array, place = elements(PlanarLattice(columns=2, rows=2, pitch=0.01)), np.array([0.0, 0.0, -0.1])
    view = {n: place + [[0, 0, 0], [1, 1, 0], [1, -1, 0]] for n in ("across", "upright")}
    return SceneGeometry(bottom, 0.0, place, array, array.position + place, {"array": place}, hulls, {}, view)


def fan(coefficient: float = np.nan) -> Look:
    return Look("fan", False, ("launch", "surface", "end"), coefficient)


def test_the_section_shows_the_profile_as_it_is() -> None:
    ray = np.array([[0.0, 0.0, -0.1], [0.3, 0.0, 0.0], [0.6, 0.0, -0.3]])
    depth, speed = np.array([0.0, 0.1, 0.3]), np.array([1500.0, 1510.0, 1490.0])
    ball = Hull("ball", *sphere([0.5, 0.0, -0.15], 0.05))
    section, profile = section_figure("tank", [ray], [fan()], depth, speed, around(0.3, ball)).axes
    assert any(np.array_equal(line.get_xydata(), ray[:, [0, 2]]) for line in section.lines)
    assert section.get_ylim()[0] < -0.3 < 0.0 < section.get_ylim()[1]
    assert np.interp(-0.1, *profile.lines[0].get_xydata()[::-1, ::-1].T) == pytest.approx(1510.0)


@pytest.mark.parametrize(("deep", "words"), [(10.0, "one scale"), (200.0, "times as large")])
def test_rays_in_space_keep_one_scale_on_all_axes_or_say_what_heights_have(deep: float, words: str) -> None:
    rays = [np.array([[0.0, 0.0, 0.0], [6.0, 0.1 * i, -1.0], [1.0, 10.0, -deep]]) for i in range(3)]
    made = space_figure("fan", rays, [fan(c) for c in (1.0, 0.5, 0.1)], around(10.0))
    axes = made.axes[0]
    assert made.get_suptitle().endswith(words)
    spans = np.array([np.ptp(limits) for limits in (axes.get_xlim(), axes.get_ylim(), axes.get_zlim())])
    spans[2] = min(spans[2], spans[:2].max())
    assert spans / np.linalg.norm(spans) == pytest.approx(axes._box_aspect / np.linalg.norm(axes._box_aspect), rel=1e-6)


def test_the_scale_of_an_image_begins_under_its_noise_and_no_deeper() -> None:
    """Noise 12 dB under the brightest beam is dark, not the middle of 50 dB; silence is no level."""
    noise = -12.0 + 0.3 * np.sin(np.arange(2000.0)).reshape(40, 50)
    assert darkest([noise]) == darkest([None, noise]) == -15.0
    assert darkest([noise, np.minimum(noise, -23.0)]) == -25.0
    noise[0, :10] = -np.inf
    assert darkest([noise]) == -15.0
    assert darkest([noise - 80.0]) == darkest([None]) == darkest([]) == -DYNAMIC_RANGE
