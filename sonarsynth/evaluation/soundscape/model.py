"""What the models of a recipe say of the sound at its hydrophones: spectrum by parts, and coherence."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.environment.noise import NoiseField
from sonarsynth.equations.noise.ambient_noise import quantisation_density
from sonarsynth.equations.noise.filters import response
from sonarsynth.equations.noise.plane_wave_spectra import cross_power, heard_share
from sonarsynth.equations.noise.wave_directions import quadrature
from sonarsynth.evaluation.soundscape.chorus_model import ChorusModel, chorus_model
from sonarsynth.planning import Plan, receiver_of
from sonarsynth.planning.noise_rows import DISTANT_CHORUS, part_names
from sonarsynth.recipe.scene import Frame
from sonarsynth.signals.electronics import ElectronicNoise
from sonarsynth.signals.filtered_pulse import fir
from sonarsynth.state import Receiver

KNOTS = 16
"""Frequencies of the band that faces are worked out at; between them spectra are interpolated."""


@dataclass(frozen=True, eq=False)
class SoundModel:
    """The sound of a recipe at an array at rest: one-sided densities in Pa2/Hz, behind the filter."""

    plan: Plan
    receiver: Receiver
    chorus: ChorusModel | None

    def parts(self, frequency: Floats) -> dict[str, Floats]:
        """Power spectral density (bin,) of each part at a hydrophone, by name."""
        environment, sonar = self.plan.scene.world.environment, self.plan.scene.sonar
        passed = response(frequency, fir(sonar.antialias)) ** 2
        above_zero = np.maximum(frequency, 1.0)  # no model is of 0 Hz
        densities = {
            name: passed * noise.density(above_zero) * self._over_band(frequency, partial(self._face, noise))
            for name, noise in zip(part_names(environment.noises), environment.noises, strict=True)
        }
        if (chorus := self.chorus) is not None:
            spread = self._over_band(frequency, self._chorus_sum)
            densities["chorus"] = 2.0 * chorus.energy * chorus.pulse_energy(frequency) * spread
        if (distant := self.plan.distant_chorus) is not None:
            face = self._over_band(frequency, partial(self._face, distant))
            densities[DISTANT_CHORUS] = passed * distant.density(above_zero) * face
        if sonar.electronics is not None:
            densities["electronics"] = passed * ElectronicNoise(sonar.electronics).density(above_zero)
        if sonar.converter is not None:
            rounding = quantisation_density(sonar.converter.quantum, sonar.sampling_frequency)
            densities["rounding"] = np.full(frequency.shape, rounding)
        return densities

    def coherence(self, frequency: float, offset: Floats) -> Floats:
        """Coherence (pair,), the real part, of hydrophones at offsets (pair, xyz) m, sonar frame, with another."""
        frequencies = np.array([frequency])
        total, alone = np.zeros(len(offset), complex), 0.0
        offsets = np.concatenate([np.zeros((1, 3)), offset])
        for name, density in self.parts(frequencies).items():
            waves = self._waves(name, frequency, float(np.linalg.norm(offsets, axis=1).max()))
            alone += float(density[0])
            if waves is not None:
                toward, weight = waves
                received = weight * self._share(toward, frequency)
                cross = cross_power(toward, received, offsets, 2.0 * np.pi * frequency / self._speed)
                total += float(density[0]) * cross[1:] / cross[0].real
        return np.asarray((total / alone).real)

    @property
    def _speed(self) -> float:
        return self.receiver.speed(self.plan.medium)

    def _share(self, toward: Floats, frequency: float) -> Floats:
        """Of plane waves (wave,): what a hydrophone hears of their power."""
        face = self.receiver.elements.face
        return heard_share(toward, frequency, face, self._speed, self.receiver.sonar.behind)

    def _over_band(self, frequency: Floats, value: Callable[[float], float]) -> Floats:
        """A function of the frequency (Hz) at frequencies (bin,), interpolated between knots where there are many."""
        low, high = max(float(frequency.min()), 1.0), float(frequency.max())
        knots = frequency if len(frequency) < KNOTS else np.linspace(low, high, KNOTS)
        return np.asarray(np.interp(frequency, knots, [value(max(f, 1.0)) for f in knots.tolist()]))

    def _face(self, noise: NoiseField, frequency: float) -> float:
        """Share of the power of a noise that a hydrophone hears."""
        waves = self._noise_waves(noise, frequency, 0.0)
        return 1.0 if waves is None else float(waves[1] @ self._share(waves[0], frequency))

    def _chorus_sum(self, frequency: float) -> float:
        """Integral of the intensity of the chorus over all elevations, as a hydrophone hears it."""
        assert self.chorus is not None
        toward, weight = self._chorus_waves(frequency, 0.0)
        return self.chorus.power(self._absorption(frequency)) * float(weight @ self._share(toward, frequency))

    def _absorption(self, frequency: float) -> float:
        return float(self.plan.absorption(frequency))

    def _waves(self, name: str, frequency: float, extent: float) -> tuple[Floats, Floats] | None:
        """Plane waves (wave, xyz), sonar frame, and weights (wave,) of sum 1, of a part; None where hydrophones hear it
        independently."""
        noises = self.plan.scene.world.environment.noises
        named = dict(zip(part_names(noises), noises, strict=True))
        if name in named:
            return self._noise_waves(named[name], frequency, extent)
        if name == DISTANT_CHORUS and self.plan.distant_chorus is not None:
            return self._noise_waves(self.plan.distant_chorus, frequency, extent)
        return self._chorus_waves(frequency, extent) if name == "chorus" else None

    def _noise_waves(self, noise: NoiseField, frequency: float, extent: float) -> tuple[Floats, Floats] | None:
        directions = noise.directions
        if directions is None:
            return None
        if directions.toward is not None:
            return self.receiver.pose.turn_to_body(directions.toward[None]), np.ones(1)
        toward, weight = quadrature(directions.intensity, directions.edges, self._degree(frequency, extent))
        return self.receiver.pose.turn_to_body(toward), weight

    def _chorus_waves(self, frequency: float, extent: float) -> tuple[Floats, Floats]:
        assert self.chorus is not None
        intensity = partial(self.chorus.intensity, absorption=self._absorption(frequency))
        toward, weight = quadrature(intensity, self.chorus.edges, self._degree(frequency, extent))
        return self.receiver.pose.turn_to_body(toward), weight

    def _degree(self, frequency: float, extent: float) -> float:
        """Phase (rad) over hydrophones so far apart and their faces."""
        return 2.0 * np.pi * frequency / self._speed * (extent + 2.0 * self.receiver.elements.face) + 1.0


def sound_model(plan: Plan, first: Frame) -> SoundModel:
    """The model of a plan for the array of its first frame."""
    return SoundModel(plan, receiver_of(plan, first), chorus_model(plan, first))
