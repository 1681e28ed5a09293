"""Sound that figures are measured of: blocks of pressure at a few hydrophones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats, Ints
from sonarsynth.receiver import Elements
from sonarsynth.recipe.scene import Scene

HYDROPHONES = 9
"""Of an array that are listened to, at most."""
SHORTEST = 64
"""Samples of a block, at least."""
BLOCK, FEWEST_BLOCKS = 0.1, 8
"""s: of a block of running sound, or less, so that there are so many at least."""
LEAST_SECONDS = 0.05
"""Of sound that is made to be measured."""
MOST_SAMPLES = 1 << 28
"""Of all hydrophones together: 1 GiB."""
ALONG = 0.97
"""Cosine of the angle to an axis within which a hydrophone lies along it from another."""


class NothingHeard(ValueError):
    """There is no sound that can be measured; str() is one line."""


@dataclass(frozen=True, eq=False)
class ArrivalElevations:
    """What is known of the snaps that are heard, by the elevation that they come from (world)."""

    sine: Floats  # (path,) of the elevation, up positive
    weight: Floats  # (path,) 1/m2: energy over that of a snap at 1 m; or 1 each, of paths above a level
    above: float | None  # dB re 1 uPa: the level; None: weights are energies
    seconds: float  # in which they were heard

    def by_elevation(self, edges: Floats) -> tuple[Floats, Floats]:
        """Sums (bin,) of the weights between sines (bin + 1,), and the standard deviation of each by chance."""
        value = np.histogram(self.sine, edges, weights=self.weight)[0]
        return value, np.sqrt(np.histogram(self.sine, edges, weights=self.weight**2)[0])


@dataclass(frozen=True, eq=False)
class Sound:
    """Pressure at hydrophones, in blocks of one length."""

    pressure: npt.NDArray[np.float32]  # (block, sensor, sample) Pa; of a recording without calibration, re full scale
    sampling_frequency: float  # Hz
    position: Floats  # (sensor, xyz) m, sonar frame
    running: bool  # each block goes on where the one before ended
    band: tuple[float, float]  # Hz
    calibrated: bool = True
    arrivals: ArrivalElevations | None = None
    notes: tuple[str, ...] = ()  # what the figures leave out, and why

    @property
    def seconds(self) -> float:
        """Of all blocks together."""
        return float(self.pressure.shape[0] * self.pressure.shape[2] / self.sampling_frequency)

    @property
    def unit(self) -> str:
        """Of levels."""
        return "dB re 1 uPa" if self.calibrated else "dB re full scale"


def model_notes(scene: Scene) -> tuple[str, ...]:
    """What is heard of a scene and is not in its model."""
    notes = []
    if scene.world.noise_sources:
        notes.append("sources of noise at one place are heard, and are not in the model")
    if scene.sonar.sensor_errors is not None:
        notes.append("errors of sensors are heard, and are not in the model")
    if scene.world.chorus is None:
        notes.append("no arrivals by elevation: the recipe has no chorus")
    return tuple(notes)


def listeners(elements: Elements, works: npt.NDArray[np.bool_]) -> Ints:
    """Numbers (sensor,) of a few elements that work: the one nearest to the centre, then some along y and along z of
    it, at distances that grow by a factor. Raises NothingHeard where none works."""
    alive = np.flatnonzero(works & (elements.gain != 0.0))
    if not alive.size:
        raise NothingHeard("every hydrophone is dead: there is no sound to measure")
    position = elements.position[alive]
    first = int(np.argmin(np.linalg.norm(position, axis=1)))
    if alive.size <= HYDROPHONES:
        return np.asarray(np.append(alive[first], np.delete(alive, first)))
    apart = position - position[first]
    away = np.linalg.norm(apart, axis=1)
    chosen = [first]
    for axis in (1, 2):
        chosen += _spaced(np.flatnonzero((away > 0.0) & (np.abs(apart[:, axis]) > ALONG * away)), away)
    if len(chosen) < HYDROPHONES:
        others = np.setdiff1d(np.flatnonzero(away > 0.0), chosen)
        chosen += _spaced(others, away)[: HYDROPHONES - len(chosen)]
    return np.asarray(alive[np.array(chosen)])


def _spaced(candidates: Ints, away: Floats) -> list[int]:
    """At most four of the candidates, whose distances grow by a factor."""
    if not candidates.size:
        return []
    wanted = np.geomspace(away[candidates].min(), away[candidates].max(), HYDROPHONES // 2)
    return list(dict.fromkeys(int(candidates[np.argmin(np.abs(away[candidates] - far))]) for far in wanted))
