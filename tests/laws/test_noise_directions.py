"""Noise of given directions: coherence, spectra through faces, and array gain, against closed forms and plain sums."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import j1

from sonarsynth.conventions import Floats
from sonarsynth.environment.noise import FlatNoise
from sonarsynth.environment.noise.directions import (
    BottomDirections,
    Directions,
    IsotropicDirections,
    NoiseDirections,
    OneDirection,
    RingDirections,
    SurfaceDirections,
)
from sonarsynth.equations.noise.filters import response
from sonarsynth.equations.noise.lattice_coherence import MARGIN, CovarianceMap
from sonarsynth.equations.noise.wave_directions import quadrature
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.products import Signals
from sonarsynth.randomness import stream
from sonarsynth.receiver import Elements, PlanarLattice, PositionTable, Romanis, Sonar, elements
from sonarsynth.signals import add_noise
from sonarsynth.signals.filtered_pulse import fir
from sonarsynth.signals.noise import lattice_noise
from sonarsynth.signals.noise.drawing import coherence_error, draw

C = 1540.0
LEVEL = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""World (rows) of an upright sonar: which way it looks does not matter."""
TILTED = Pose(np.array([0.0, 0.0, -5.0]), quaternion(0.4, pitch=0.5, roll=-0.3))
FINE = elements(PlanarLattice(columns=10, rows=8, pitch=0.02))


def direct_coherence(directions: NoiseDirections, apart: Floats, k: float, pose: Pose, face: float) -> Floats:
    """Covariance at separations (pair, xyz) of the sonar frame of square faces: a plain sum over the sphere, by the
    midpoint rule, with the directivity of a face written out."""
    edges = np.array(directions.edges)
    found, total = np.zeros(len(apart), complex), 0.0
    azimuth = 2.0 * np.pi * (np.arange(160) + 0.5) / 160
    for low, high in itertools.pairwise(edges):
        for v in low + (high - low) * (np.arange(400) + 0.5) / 400:
            across = np.sqrt(1.0 - v * v)
            world = np.stack([across * np.cos(azimuth), across * np.sin(azimuth), np.full(160, v)], axis=1)
            u = pose.turn_to_body(world)
            power = float(directions.intensity(np.array([v]))[0]) * (high - low)
            heard = np.prod([np.sinc(0.5 * k * face * u[:, n] / np.pi) ** 2 for n in (1, 2)], axis=0)
            found += power * np.mean(heard * np.exp(1j * k * (apart @ u.T)), axis=1)
            total += power
    return found / total


@pytest.mark.parametrize(("directions", "worst"), [(IsotropicDirections(), 1e-5), (SurfaceDirections(), 1e-5)])
def test_coherence_is_the_closed_form_of_cron_and_sherman(directions: NoiseDirections, worst: float) -> None:
    k, pitch = 2.0 * np.pi * 25e3 / C, 49.53e-3
    reach = 26 * k * pitch
    toward, weight = quadrature(directions.intensity, directions.edges, 1.5 * reach + MARGIN)
    found = CovarianceMap.of(toward @ LEVEL, weight, reach).at_lags(k * pitch, 0.0, (26, 26))
    x = k * pitch * np.arange(1, 26)
    if directions.kind == "isotropic":
        across, up = np.sin(x) / x, np.sin(x) / x
        assert found[1, 0].real == pytest.approx(-0.186631, abs=1e-5)
    else:
        across, up = 2.0 * j1(x) / x, 2.0 * (np.exp(1j * x) * (1.0 / (1j * x) + x**-2.0) - x**-2.0)
        assert found[1, 0].real == pytest.approx(-0.131810, abs=1e-5)
        assert found[0, 1] == pytest.approx(-0.425515 - 0.205777j, abs=1e-5)
        assert found[0, -1] == pytest.approx(np.conj(found[0, 1]))
    assert found[0, 0] == pytest.approx(1.0, abs=1e-6)
    np.testing.assert_allclose(found[1:26, 0], across, atol=worst)
    np.testing.assert_allclose(found[0, 1:26], up, atol=worst)


@pytest.mark.parametrize("frequency", [5e3, 85e3])
def test_one_map_of_covariances_holds_those_of_faces_at_all_lower_frequencies(frequency: float) -> None:
    """Its waves and their sum were worked out anew for each of hundreds of frequencies: planning took half a minute."""
    k, most, pitch, face, directions = (
        2.0 * np.pi * frequency / C,
        2.0 * np.pi * 90e3 / C,
        0.03,
        0.025,
        BottomDirections(),
    )
    toward, weight = quadrature(directions.intensity, directions.edges, 1.5 * most * 0.325 + MARGIN)
    wave = toward @ TILTED.turn_to_body(np.eye(3))
    found = CovarianceMap.of(wave, weight, most * 0.325).at_lags(k * pitch, k * face, (10, 8))
    heard = weight * np.prod(np.sinc(0.5 * k * face * wave[:, 1:] / np.pi) ** 2, axis=1)
    for m, n in ((0, 0), (1, -1), (9, 7), (-4, 0)):
        exact = np.sum(heard * np.exp(1j * k * pitch * (m * wave[:, 1] + n * wave[:, 2])))
        assert abs(found[m, n] - exact) < 1e-5


ARRAY_GAIN = {  # dB, beams of elevation 0, -5, +20 deg at 25, 50 and 85 kHz
    "isotropic": ((32.6, 32.6, 27.8), (27.5, 27.2, 27.7), (28.9, 27.6, 28.8)),
    "surface": ((40.2, 39.6, 31.2), (27.7, 29.0, 26.1), (29.6, 27.1, 29.7)),
    "ring": ((28.3, 22.3, 42.8), (32.8, 22.7, 41.1), (36.8, 24.8, 25.5)),
}


@pytest.mark.parametrize("directions", [IsotropicDirections(), SurfaceDirections(), RingDirections()])
def test_array_gain_of_the_disc_is_that_of_an_independent_prototype(directions: NoiseDirections) -> None:
    lattice = lattice_noise.lattice_of(replace(elements(Romanis()), face=0.0), np.array([0.0, 0.0, 1.0]), C)
    y, z = np.transpose(lattice.places)
    for frequency, gains in zip((25e3, 50e3, 85e3), ARRAY_GAIN[directions.kind], strict=True):
        powers, _ = lattice_noise._powers(directions, lattice, np.array([frequency]), lattice_noise._lags(lattice, 1.4))
        for elevation, gain in zip((0.0, -5.0, 20.0), gains, strict=True):
            weights = np.zeros(powers[0].shape, complex)
            turn = 2.0 * np.pi * frequency / C * np.sin(np.deg2rad(elevation)) * lattice.pitch
            weights[y, z] = np.exp(-1j * turn * z) / len(y)
            beam = np.sum(powers[0] * np.abs(np.fft.ifft2(weights) * weights.size) ** 2) / powers[0].sum()
            assert -10.0 * np.log10(beam) == pytest.approx(gain, abs=0.65 if gain > 38.0 else 0.25)


@pytest.mark.parametrize("pose", [Pose(np.zeros(3), quaternion(1.0)), TILTED], ids=["level", "tilted"])
@pytest.mark.parametrize(
    "directions",
    [SurfaceDirections(exponent=1.5), BottomDirections(lowest=0.1, images=False), RingDirections()],
    ids=["surface", "bottom", "ring"],
)
def test_the_field_of_a_lattice_has_the_covariance_of_a_plain_sum(directions: NoiseDirections, pose: Pose) -> None:
    up = pose.turn_to_body([0.0, 0.0, 1.0])
    field = lattice_noise.periodic_field(directions, lattice_noise.lattice_of(FINE, up, C), 70e3, 84e3)
    assert field is not None
    some = np.array([[m, n] for m in (0, 1, 3, 9) for n in (-7, -2, 0, 1, 5)])
    apart = 0.02 * np.column_stack([np.zeros(len(some)), some])
    for knot in (0, -1):
        exact = direct_coherence(directions, apart, 2.0 * np.pi * field.frequency[knot] / C, pose, 0.02)
        found = np.fft.ifft2(field.powers[knot])[some[:, 0], some[:, 1]]
        assert np.abs(found - exact).max() < (field.error + 2e-3) * exact[some.tolist().index([0, 0])].real
    assert field.error < lattice_noise.FAIR


def covariance(noise: FlatNoise, array: Elements, pose: Pose, draws: int, f: Floats) -> Floats:
    """Covariance (sensor, sensor) of spectra at frequencies near each other, of 1 Pa2/Hz."""
    assert noise.directions is not None
    x = [draw(noise.directions, array, pose, Sonar(), f, C, stream(3, "draw", n)) for n in range(draws)]
    spectra = np.concatenate(x, axis=1)
    return np.asarray(spectra @ spectra.conj().T / (2.0 * spectra.shape[1]))


@pytest.mark.parametrize(
    "array",
    [FINE, elements(PositionTable(positions=((0, 0, 0), (0.01, 0.02, 0), (0, -0.03, 0.02), (0, 0, -0.1)), face=0.01))],
    ids=["lattice", "positions"],
)
@pytest.mark.parametrize("directions", [SurfaceDirections(), RingDirections()], ids=["surface", "ring"])
def test_what_is_drawn_has_the_covariance_of_a_plain_sum(array: Elements, directions: Directions) -> None:
    noise = FlatNoise(level=120.0, directions=directions)
    f = np.linspace(69.99e3, 70.01e3, 60)
    found, snapshots = covariance(noise, array, TILTED, 40, f), 40 * 60
    some = [(0, 0), (0, 1), (1, 2), (0, 3), (2, 3)]
    apart = np.array([array.position[a] - array.position[b] for a, b in some])
    assert not isinstance(directions, OneDirection)
    exact = direct_coherence(directions, apart, 2.0 * np.pi * 70e3 / C, TILTED, array.face)
    measured = np.array([found[a, b] for a, b in some])
    assert np.abs(measured - exact).max() < exact[0].real * (4.0 / np.sqrt(snapshots) + 5e-3)


def test_what_is_drawn_is_gaussian_at_a_hydrophone_and_in_a_beam() -> None:
    """Of a complex normal number <|x|^4> = 2 <|x|^2>^2, real and imaginary part alike and independent."""
    f = np.linspace(60e3, 80e3, 20_000)
    x = draw(IsotropicDirections(), FINE, TILTED, Sonar(), f, C, stream(2, "gaussian"))
    for one in (x[0], x.mean(axis=0)):
        power = np.mean(np.abs(one) ** 2)
        assert np.mean(np.abs(one) ** 4) / power**2 == pytest.approx(2.0, abs=4.0 * np.sqrt(20.0 / f.size))
        assert abs(np.mean(one**2)) < 4.0 * power / np.sqrt(f.size)
        assert np.abs(one).max() ** 2 / power == pytest.approx(np.log(f.size), abs=5.0)  # of as many, the largest


@pytest.mark.parametrize("side", [8, 16])
def test_beams_of_many_sensors_scatter_in_few_plane_waves_as_a_plan_says(side: int) -> None:
    """Of arrays that are no lattice: a beam hears one wave in as many as there are sensors half a wavelength apart."""
    square = elements(PlanarLattice(columns=side, rows=side, pitch=0.5 * C / 75e3, face=0.0)).position
    array = elements(PositionTable(positions=tuple(map(tuple, square.tolist()))))
    method = coherence_error(IsotropicDirections(), array, TILTED, Sonar(), C)[1]
    f, steered = np.full(600, 75e3), np.linspace(-0.6, 0.6, 7)
    x = draw(IsotropicDirections(), array, TILTED, Sonar(), f, C, stream(3, "beams"))
    scatter = []
    for y, z in itertools.product(steered, steered):
        energy = np.abs(np.exp(-2j * np.pi * 75e3 / C * (square[:, 1:] @ [y, z])) @ x) ** 2
        scatter.append(np.std(energy) / np.mean(energy))
    said = float(method.split("scatter ")[1].split(" times")[0])
    assert said > 1.05 and np.sqrt(np.mean(np.square(scatter))) == pytest.approx(said, abs=0.03)


def test_noise_of_one_direction_gives_the_beam_pattern_of_the_array() -> None:
    array, pose = elements(PlanarLattice(columns=6, rows=4, pitch=0.02)), Pose(np.zeros(3), quaternion(0.5 * np.pi))
    wave = OneDirection(bearing=np.deg2rad(80.0), elevation=np.deg2rad(12.0))
    f = np.array([60e3])
    x = draw(wave, array, pose, Sonar(), f, C, stream(1, "wave"))[:, 0]
    from_there, k = wave.toward, 2.0 * np.pi * 60e3 / C
    face = np.prod(np.sinc(0.5 * k * 0.02 * from_there[1:] / np.pi))
    for azimuth in (-0.3, 0.0, np.deg2rad(10.0)):
        steered = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        beam = np.exp(-1j * k * (array.position @ steered)) @ x / array.count
        m, n = 5.0 - 2.0 * np.arange(6), 3.0 - 2.0 * np.arange(4)
        sines = from_there - steered
        pattern = np.mean(np.exp(0.01j * k * m * sines[1])) * np.mean(np.exp(0.01j * k * n * sines[2])) * face
        assert np.abs(beam) / np.abs(x[0]) == pytest.approx(np.abs(pattern / face), abs=1e-5)


@pytest.mark.parametrize("directions", [None, IsotropicDirections()], ids=["independent", "isotropic"])
def test_the_level_is_that_of_the_model_through_the_face(directions: Directions | None) -> None:
    sonar, samples = Sonar(), 16384
    array = elements(PlanarLattice(columns=9, rows=8, pitch=0.015, face=0.0 if directions is None else 0.015))
    quiet = Signals(np.zeros((array.count, samples), np.float32), 0.0, sonar.sampling_frequency, 0.0, 0, 0)
    noise = FlatNoise(level=100.0, directions=directions)
    heard = add_noise(quiet, noise, sonar, array, stream(5, "level"), TILTED, C).pressure
    f = np.fft.rfftfreq(samples, 1.0 / sonar.sampling_frequency)
    inside = (f > 40e3) & (f < 70e3)
    taper = np.hanning(samples)
    density = 2.0 * np.abs(np.fft.rfft(heard * taper)) ** 2 / (sonar.sampling_frequency * np.sum(taper**2))
    measured = np.mean(density[:, inside] / response(f[inside], fir(sonar.antialias)) ** 2)
    share = 1.0
    if directions is not None:
        k = 2.0 * np.pi * np.linspace(40e3, 70e3, 5) / C
        share = np.mean(
            [direct_coherence(IsotropicDirections(), np.zeros((1, 3)), one, TILTED, 0.015)[0].real for one in k]
        )
        assert share < 0.9, "or the face does nothing"
    assert 10.0 * np.log10(measured / (1e-2 * share)) == pytest.approx(0.0, abs=0.1)
