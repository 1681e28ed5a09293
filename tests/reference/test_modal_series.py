"""The modal series against exact arithmetic, published values, limits and conservation laws."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from sonarsynth.equations.scattering.modal_series import (
    Boundary,
    Fluid,
    cylinder_amplitude,
    sphere_amplitude,
    sphere_coefficients,
)

ANGLES = np.array([0.0, 0.5, 2.0, np.pi])
STEEL, FLESH, BUBBLE = Fluid(8.0, 3.3), Fluid(1.05, 1.03), Fluid(0.00129, 0.22)
LOSSLESS: list[Boundary] = ["rigid", "soft", STEEL, FLESH, BUBBLE]


def unit_sphere(ka: float | np.ndarray, angle: float | np.ndarray, boundary: Boundary = "rigid") -> np.ndarray:
    """Radius 1 m and a sound speed of 2 pi m/s: the frequency is k, and ka."""
    return sphere_amplitude(ka, angle, radius=1.0, sound_speed=2 * np.pi, boundary=boundary)


def by_exact_arithmetic(ka: float, boundary: Boundary) -> np.ndarray:
    """The series in 50 digits, term by term, with more terms, at `ANGLES`."""
    with mp.workdps(50):
        x = mp.mpf(ka)
        orders = int(ka + 4 * ka ** (1 / 3) + 30)

        def with_slopes(values, z):
            return values[:orders], [n / z * values[n] - values[n + 1] for n in range(orders)]

        def regular(z):  # from far above down (Miller)
            values = [mp.mpf(0), mp.mpf(1)]
            for n in range(max(orders, int(z + 4 * z ** (1 / 3))) + 60, 0, -1):
                values.append((2 * n + 1) / z * values[-1] - values[-2])
            values.reverse()
            scale = mp.sin(z) / z / values[0]  # j0; no multiple of pi is among the arguments
            return with_slopes([v * scale for v in values], z)

        def singular(z):
            values = [-mp.cos(z) / z, -mp.cos(z) / z**2 - mp.sin(z) / z]
            for n in range(1, orders):
                values.append((2 * n + 1) / z * values[-1] - values[-2])
            return with_slopes(values, z)

        (j, j1), (y, y1) = regular(x), singular(x)
        if isinstance(boundary, Fluid):
            i, i1 = regular(x / mp.mpf(boundary.speed_ratio))
            q = 1 / (mp.mpf(boundary.density_ratio) * mp.mpf(boundary.speed_ratio))
            u = [j1[n] * i[n] - q * i1[n] * j[n] for n in range(orders)]
            w = [y1[n] * i[n] - q * i1[n] * y[n] for n in range(orders)]
        else:
            u, w = (j1, y1) if boundary == "rigid" else (j, y)
        total = [mp.mpc(0)] * ANGLES.size
        for a, angle in enumerate(ANGLES):
            c = mp.cos(mp.mpf(float(angle)))
            before, p = mp.mpf(0), mp.mpf(1)
            for n in range(orders):
                total[a] += (2 * n + 1) * -u[n] / (u[n] - 1j * w[n]) * p
                before, p = p, ((2 * n + 1) * c * p - n * before) / (n + 1)
        return np.array([complex(1j / x * t) for t in total])


@pytest.mark.parametrize("boundary", LOSSLESS)
@pytest.mark.parametrize("ka", [1e-6, 1e-2, 1.0, 7.7, 50.0])
def test_spheres_agree_with_exact_arithmetic(ka: float, boundary: Boundary) -> None:
    exact = by_exact_arithmetic(ka, boundary)
    np.testing.assert_allclose(unit_sphere(ka, ANGLES, boundary), exact, rtol=2e-12, atol=1e-13 * abs(exact).max())


@pytest.mark.parametrize("boundary", ["rigid", STEEL])
def test_large_spheres_agree_with_exact_arithmetic(boundary: Boundary) -> None:
    exact = by_exact_arithmetic(1000.0, boundary)
    np.testing.assert_allclose(unit_sphere(1000.0, ANGLES, boundary), exact, rtol=3e-10)
    assert abs(unit_sphere(1000.0, ANGLES, boundary) - exact).max() < 1e-12 * abs(exact).max()


@pytest.mark.parametrize(
    ("radius", "strengths"),
    [
        (0.05, [-32.7625, -31.9749, -32.1553, -32.0808, -32.0185]),
        (0.25, [-18.1437, -18.0271, -18.0559, -18.0700, -18.0666]),
        (0.50, [-12.0453, -12.0452, -12.0399, -12.0425, -12.0413]),
    ],
)
def test_target_strengths_of_rigid_spheres(radius: float, strengths: list[float]) -> None:
    """From another program, to the digits given; sound speed 1500 m/s."""
    amplitude = sphere_amplitude([25e3, 45e3, 65e3, 85e3, 105e3], np.pi, radius=radius)
    np.testing.assert_allclose(20 * np.log10(abs(amplitude)), strengths, atol=5.1e-5)


def test_bistatic_target_strengths_of_a_rigid_sphere() -> None:
    """From another program: radius 0.25 m, 50 kHz, degrees away from backscatter; the last is the shadow."""
    away = np.radians([0, 30, 60, 90, 120, 150, 170, 180])
    strength = 20 * np.log10(abs(sphere_amplitude(50e3, np.pi - away, radius=0.25)))
    given = [-18.07, -18.07, -18.06, -17.97, -17.77, -21.26, -8.60, 15.77]
    np.testing.assert_allclose(strength, given, atol=5.1e-3)


def test_target_strengths_of_a_rigid_cylinder() -> None:
    """From another program, broadside: radius 0.1 m, length 1.6 m."""
    amplitude = cylinder_amplitude([25e3, 50e3, 75e3, 100e3], np.pi / 2, radius=0.1, length=1.6)
    np.testing.assert_allclose(20 * np.log10(abs(amplitude)), [3.372, 6.288, 8.049, 9.315], atol=5.1e-4)


@pytest.mark.parametrize("boundary", LOSSLESS)
def test_what_is_scattered_is_missing_straight_ahead(boundary: Boundary) -> None:
    """Optical theorem: -(4 pi/k) Im f(0) is the power scattered all around, which is that of the modes."""
    k = np.array([1e-3, 0.1, 1.0, 5.0, 30.0, 200.0])
    node, weight = np.polynomial.legendre.leggauss(300)
    f = unit_sphere(k[:, None], np.arccos(node), boundary)
    around = 2 * np.pi * (abs(f) ** 2 @ weight)
    np.testing.assert_allclose(-4 * np.pi / k * unit_sphere(k, 0.0, boundary).imag, around, rtol=1e-10)


@pytest.mark.parametrize("boundary", LOSSLESS)
def test_no_mode_loses_energy(boundary: Boundary) -> None:
    a = sphere_coefficients(np.geomspace(1e-6, 1e3, 40), boundary)
    assert np.isfinite(a).all()
    np.testing.assert_allclose(abs(1 + 2 * a), 1.0, atol=1e-12)
    assert (abs(a[-1]) < 1e-9).all()  # and the sum has ended


def test_small_spheres_obey_rayleighs_law() -> None:
    """f = k^2 a^3 ((1/(g h^2) - 1)/3 + (g - 1)/(2 g + 1) cos angle), Rayleigh (1896), section 335; soft: -a."""
    k, a = 2 * np.pi * 10.0 / 1500, 0.3 / 1e3
    cosine = np.cos(ANGLES)
    for boundary in (STEEL, FLESH, Fluid(2.0, 0.5)):
        g, h = boundary
        law = k**2 * a**3 * ((1 / (g * h * h) - 1) / 3 + (g - 1) / (2 * g + 1) * cosine)
        got = sphere_amplitude(10.0, ANGLES, radius=a, boundary=boundary)
        np.testing.assert_allclose(got, law, rtol=1e-9, atol=1e-9 * abs(law).max())
    rigid = sphere_amplitude(10.0, ANGLES, radius=a)
    np.testing.assert_allclose(rigid, k**2 * a**3 * (cosine / 2 - 1 / 3), rtol=1e-9)
    np.testing.assert_allclose(sphere_amplitude(0.0, ANGLES, radius=a, boundary="soft"), -a, rtol=1e-12)
    assert (abs(sphere_amplitude(0.0, ANGLES, radius=a)) < 1e-100).all()


def test_a_fluid_sphere_tends_to_rigid_and_soft_ones_and_vanishes_in_its_own_fluid() -> None:
    k = np.array([0.1, 3.0, 40.0])[:, None]
    np.testing.assert_allclose(unit_sphere(k, ANGLES, Fluid(1e9, 0.9)), unit_sphere(k, ANGLES), rtol=1e-5)
    np.testing.assert_allclose(unit_sphere(k, ANGLES, Fluid(1e-11, 0.9)), unit_sphere(k, ANGLES, "soft"), rtol=1e-5)
    assert abs(unit_sphere(k, ANGLES, Fluid(1.0, 1.0))).max() < 1e-13


def test_large_bodies_send_back_the_echo_of_their_nearest_point() -> None:
    """Sphere (a/2) exp(2 i k a), its negative if soft; cylinder sqrt(a/(2 lambda)) L exp(2 i k a + i pi/4)."""
    k = 900.0 + np.arange(5)
    np.testing.assert_allclose(unit_sphere(k, np.pi), 0.5 * np.exp(2j * k), rtol=2e-3)
    np.testing.assert_allclose(unit_sphere(k, np.pi, "soft"), -0.5 * np.exp(2j * k), rtol=2e-3)
    got = cylinder_amplitude(k, np.pi / 2, radius=1.0, length=7.0, sound_speed=2 * np.pi)
    np.testing.assert_allclose(got, 7.0 * np.sqrt(k / (4 * np.pi)) * np.exp(2j * k + 0.25j * np.pi), rtol=2e-3)


@pytest.mark.parametrize("ka", [1e-3, 4.0, 30.0])
def test_cylinders_agree_with_exact_arithmetic(ka: float) -> None:
    with mp.workdps(40):
        total = mp.mpc(0)
        for m in range(int(ka + 4 * ka ** (1 / 3) + 25)):
            j, y = ((f(m - 1, mp.mpf(ka)) - f(m + 1, mp.mpf(ka))) / 2 for f in (mp.besselj, mp.bessely))
            total += (1 if m == 0 else 2) * (-1) ** m * j / (j - 1j * y)
        exact = complex(-1j / mp.pi * total)
    got = cylinder_amplitude(ka, np.pi / 2, radius=1.0, length=1.0, sound_speed=2 * np.pi)
    assert complex(got) == pytest.approx(exact, rel=1e-12)


def test_a_cylinder_has_the_lobes_of_its_length_and_no_ends() -> None:
    k, length = 60.0, 1.6
    null = np.arccos(np.pi / (k * length))
    aspect = np.array([np.pi / 2, null, np.pi - null, 0.0, np.pi])
    f = cylinder_amplitude(k, aspect, radius=0.1, length=length, sound_speed=2 * np.pi)
    assert (abs(f[1:]) < 1e-12 * abs(f[0])).all()
    small = cylinder_amplitude([1e-6, 2e-6, 0.0], np.pi / 2, radius=1.0, length=1.0, sound_speed=2 * np.pi)
    np.testing.assert_allclose(small[:2], -np.array([1.0, 4.0]) * 1e-12 * 0.75, rtol=1e-9)  # k^2 a^2 L (1/4 + 1/2)
    assert abs(small[2]) < 1e-100


def test_arguments_broadcast() -> None:
    f, a = np.array([20e3, 80e3]), np.array([0.1, 0.2])
    together = sphere_amplitude(f[:, None, None], ANGLES, radius=a[:, None], sound_speed=1480.0)
    assert together.shape == (2, 2, 4)
    alone = sphere_amplitude(f[1], ANGLES[2], radius=a[0], sound_speed=1480.0)
    assert alone.shape == ()
    assert together[1, 0, 2] == pytest.approx(complex(alone), rel=1e-12)
    assert cylinder_amplitude(f[:, None], ANGLES, radius=0.1, length=1.0).shape == (2, 4)


@pytest.mark.parametrize("wrong", [{"radius": 0.0}, {"radius": np.nan}, {"sound_speed": -1.0}, {"frequency": -1.0}])
def test_numbers_that_are_none_are_refused(wrong: dict[str, float]) -> None:
    given = {"frequency": 1e3, "radius": 0.1, "sound_speed": 1500.0} | wrong
    frequency = given.pop("frequency")
    with pytest.raises(ValueError, match="must be a number"):
        sphere_amplitude(frequency, np.pi, **given)


def test_unknown_boundaries_are_refused() -> None:
    with pytest.raises(ValueError, match="'rigid', 'soft' or Fluid"):
        sphere_amplitude(1e3, np.pi, radius=0.1, boundary="hard")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="ratio of a fluid"):
        sphere_amplitude(1e3, np.pi, radius=0.1, boundary=Fluid(-1.0, 1.0))
