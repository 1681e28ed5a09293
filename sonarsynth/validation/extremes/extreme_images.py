"""Every beamformer where it is hardest: silence, one sensor, one frequency, coherent waves, faint and loud."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any, get_args

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.imaging import Beamformer, LpMean
from sonarsynth.products import Signals
from sonarsynth.receiver import BeamGrid, PlanarLattice, PositionTable, Sonar, elements
from sonarsynth.receiver.hydrophones import Array
from sonarsynth.validation.extremes.outcomes import Case, CaseResult, holds, refused, together

RATE, SENSORS = 196e3, 20
LATTICE = PlanarLattice(columns=5, rows=4, pitch=0.02)
ALONE = PlanarLattice(columns=5, rows=4, pitch=0.02, dead=tuple(i for i in range(SENSORS) if i != 7))
LINE = PlanarLattice(columns=SENSORS, rows=1, pitch=0.02)
TABLE = PositionTable(positions=((0.0, 0.0, 0.0), (0.0, 0.03, 0.01), (0.01, -0.02, 0.04)))
WHOLE = 0.001, 0.003


def methods(array: Array = LATTICE) -> Iterator[Any]:
    """All beamformers as they come, and the mean of logarithms over windows, that take the array."""
    kinds: tuple[type[Any], ...] = get_args(get_args(Beamformer)[0])
    beamformers = [*(kind() for kind in kinds), LpMean(p=0.0, window=1e-4)]
    return (method for method in beamformers if not method.refusal(elements(array)))


@cache
def noise(sensors: int = SENSORS) -> Floats:
    """Pressure (sensor, sample) in Pa."""
    return np.random.default_rng(2).normal(size=(sensors, 700))


def energy(method: Any, pressure: Floats, array: Array = LATTICE, window: tuple[float, float] = WHOLE) -> np.ndarray:
    """The image (elevation, azimuth) of a window of pressure."""
    sonar = Sonar(array=array, beams=BeamGrid(azimuths=7, elevations=6))
    heard = Signals(pressure.astype(np.float32), 0.0, RATE, 0.0, 0, 0)
    return np.asarray(method.image(heard, elements(array), sonar, *window).energy, float)


def _sound(image: np.ndarray) -> bool:
    return bool(np.isfinite(image).all() and (image >= 0.0).all() and image.any())


def _arrays() -> CaseResult:
    """Numbers for noise, zeros for silence."""
    results = []
    for array in (LATTICE, LINE, ALONE, TABLE):
        heard = noise(elements(array).count)
        for method in methods(array):
            silent = energy(method, 0.0 * heard, array)
            fine = _sound(energy(method, heard, array)) and not silent.any()
            results.append(holds(fine, f"{method.kind}: numbers of noise, zeros of silence"))
    return together(results)


def _one_frequency() -> CaseResult:
    short = WHOLE[0], WHOLE[0] + 4.01 / RATE
    return together([holds(_sound(energy(m, noise(), window=short)), f"{m.kind}: numbers") for m in methods()])


def _coherent() -> CaseResult:
    """Two waves that are one wave, one of them later, and nothing else."""
    same = np.tile(noise(1), (SENSORS, 1))
    both = same + 1e-3 * np.roll(same, 3, axis=1)
    return together([holds(_sound(energy(m, both)), f"{m.kind}: numbers") for m in methods()])


def _faint_and_loud() -> CaseResult:
    """Energy goes with the square of the pressure."""
    results = []
    for method in methods():
        reference = energy(method, noise())
        for factor in (1e-9, 1e9):
            apart = np.abs(energy(method, factor * noise()) / factor**2 - reference).max() / reference.max()
            results.append(holds(apart < 1e-4, f"{method.kind}: {apart:.1g} apart at {factor:g} times the pressure"))
    return together(results)


def _spoilt() -> CaseResult:
    """No number comes of what is none, and no image of dead sensors."""
    bad = noise().copy()
    bad[3, 400] = np.nan
    dead = PlanarLattice(columns=5, rows=4, pitch=0.02, dead=tuple(range(SENSORS)))
    return together(
        [holds(bool(np.isnan(energy(m, bad)).all()), f"{m.kind}: no number") for m in methods()],
        [refused(lambda m=m: energy(m, noise(), dead), "no live element") for m in methods(dead)],  # type: ignore[misc]
    )


CASES = (
    Case("images of a line, one live sensor, three anywhere", "numbers; of silence zeros; every beamformer", _arrays),
    Case("images of one frequency", "numbers, by every beamformer", _one_frequency),
    Case("images of two coherent waves", "numbers, by every beamformer", _coherent),
    Case("images of 1e-9 and 1e9 Pa", "energies by the square of the pressure, to 1e-4", _faint_and_loud),
    Case("images of a number that is none, and of dead sensors", "none, by any beamformer; refused", _spoilt),
)
