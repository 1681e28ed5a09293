"""Stacks of windows of a scene at rest: how surely a faint echo is told, and what moves or is not there is refused."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import sonarsynth.loading  # noqa: F401 - registers the accessor
from sonarsynth.loading.stacking import stacked_index

DEGREES, BEAM = 410, (7, 3)


def tree(energy, shift=0.0):
    """A store of images (frame, elevation, azimuth) with one target that drifts by `shift` (deg) a frame."""
    box = np.array([-1.0, 1.0, -1.0, 1.0]) + shift * np.arange(len(energy))[:, None] * [1, 1, 0, 0]
    truth = xr.Dataset({"sonar_position": (("frame", "xyz"), np.zeros((len(energy), 3)))})
    targets = xr.Dataset(
        {"image_box": (("frame", "target", "bound"), box[:, None])}, coords={"target": ("target", ["ball"])}
    )
    images = xr.Dataset({"energy": (("frame", "elevation", "azimuth"), energy)})
    made = xr.DataTree.from_dict({"/": xr.Dataset(), "/truth": truth, "/truth/targets": targets, "/image": images})
    made.attrs |= {"band_low": 25e3, "band_high": 85e3, "aperture_radius": 0.6, "assumed_sound_speed": 1540.0}
    return made


def noise(windows, random, spoilt=0.0):
    """Energies of Gaussian noise in 12 by 10 beams; a share of the windows has a stranger 13 dB over it elsewhere."""
    energy = random.gamma(DEGREES, 1.0 / DEGREES, (windows, 12, 10))
    return energy + 20.0 * (random.uniform(size=(windows, 1, 1)) < spoilt) * random.uniform(size=(windows, 12, 10))


def index(statistic, windows, ratio, random):
    """Standard deviations by which an echo of `ratio` (dB) is told, of 120 beams in 30 stacks."""
    beams = np.concatenate([np.ravel(statistic(noise(windows, random))) for _ in range(30)])
    return 10.0 ** (ratio / 10.0) / beams.std()


def test_a_stack_tells_an_echo_as_the_law_says():
    random = np.random.default_rng(3)
    for windows, ratio in ((40, -13.0), (101, -15.0)):
        found = index(lambda energy: tree(energy).sonar.stack(), windows, ratio, random)
        assert found == pytest.approx(stacked_index(ratio, DEGREES, windows), rel=0.05)
    mean = index(lambda energy: energy.mean(axis=0), 40, -13.0, random)
    assert mean == pytest.approx(stacked_index(-13.0, DEGREES, 40) * np.sqrt(np.pi / 2.0), rel=0.05)
    windows = (5.0 / 0.1) ** 2 / (2.0 / np.pi * DEGREES)
    assert stacked_index(-10.0, DEGREES, windows) == pytest.approx(5.0) and 9.0 < windows < 10.0


def test_the_median_finds_what_the_mean_of_spoilt_windows_does_not():
    random = np.random.default_rng(8)
    hits = np.zeros(2)
    for _ in range(50):
        energy = noise(40, random, spoilt=0.1)
        energy[:, *BEAM] += 10.0**-1.0
        for n, image in enumerate((tree(energy).sonar.stack().values, energy.mean(axis=0))):
            hits[n] += np.unravel_index(image.argmax(), image.shape) == BEAM
    assert hits[0] >= 45 and hits[1] <= 15


def test_a_scene_that_moves_and_one_without_images_are_refused():
    energy = noise(4, np.random.default_rng(1))
    assert tree(energy, shift=0.1).sonar.stack([0, 2]).dims == ("elevation", "azimuth")
    with pytest.raises(ValueError, match=r"ball moves 3\.0 deg in these frames: more than half of a beam of 1\.\d deg"):
        tree(energy, shift=1.0).sonar.stack()
    energy[1] = np.nan
    np.testing.assert_array_equal(tree(energy).sonar.stack().values, np.median(energy[[0, 2, 3]], axis=0))
    with pytest.raises(ValueError, match="none of the frames has an image"):
        tree(energy).sonar.stack([1])
