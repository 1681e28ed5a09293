"""What a model of ambient noise says of itself: one that is independent between hydrophones needs its density alone."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Complexes, Floats
from sonarsynth.description.method import FrameSize, Method, returned
from sonarsynth.environment.noise.directions import NoiseDirections

ROUNDING = 1e-10
"""Of the mean power of a hydrophone, added to the diagonal of a cross spectral density before it is factored: closely
spaced hydrophones hear the same, and their matrix is singular but for rounding."""
SECONDS, PRODUCT_SECONDS = 4.5e-9, 0.1e-9
"""Of one core to draw a sample of one hydrophone; and for a product of two numbers where noise is correlated."""


class NoiseField(Method):
    """Gaussian noise at the hydrophones, stationary in a frame; as it stands, independent between them."""

    directions: NoiseDirections | None = None
    """Where it comes from, at point hydrophones of the density; none: it is independent between hydrophones, or says
    its cross spectral density itself."""

    def density(self, frequency: Floats) -> Floats:
        """One-sided power spectral density (Pa2/Hz) at each hydrophone, at frequencies (Hz, positive)."""
        raise NotImplementedError(f"{type(self).__name__} has no density")

    def cross_spectral_density(self, frequency: Floats, position: Floats) -> Complexes | Floats | None:
        """One-sided cross spectral density (frequency, sensor, sensor) in Pa2/Hz, `E[x y*]` of spectra of exp(+i 2 pi f
        t), at positions (sensor, xyz) m in the world; none: diagonal, of the density."""
        return None

    def factors(self, frequency: Floats, position: Floats) -> Complexes | Floats | None:
        """Factors A (frequency, sensor, factor) of the cross spectral density A A^H; none: it is diagonal.

        Worth writing where they are known, as of noise that comes as a few plane waves. Raises ValueError for a matrix
        that no noise can have.
        """
        matrix = self.cross_spectral_density(frequency, position)
        if matrix is None:
            return None
        shape = (len(frequency), len(position), len(position))
        returned(self, "cross_spectral_density", matrix, shape, unknown=True)
        power = np.trace(matrix, axis1=1, axis2=2).real / matrix.shape[1]
        returned(self, "cross_spectral_density", power, frequency.shape)
        try:
            return np.linalg.cholesky(matrix + ROUNDING * power[:, None, None] * np.eye(matrix.shape[1]))
        except np.linalg.LinAlgError:
            raise ValueError(f"{self.kind} noise: its cross spectral density is not that of any noise") from None

    @property
    def correlated(self) -> bool:
        """Whether it states a cross spectral density of its own."""
        return self.factors(np.array([1e4]), np.eye(2, 3)) is not None

    @property
    def played(self) -> bool:
        """Whether it is heard as it was recorded, and nothing is drawn but where it comes from."""
        return False

    def cost(self, size: FrameSize) -> float:
        """As `Method.cost`."""
        products = size.samples // 2 * size.sensors**3 / 3.0 if self.correlated else 0.0
        return SECONDS * size.sensors * size.samples + PRODUCT_SECONDS * products

    def validity(self, low: float, high: float) -> tuple[str, ...]:
        """Where its formulas do not hold in a band (Hz), one line each; `plan` says these, and the store has them."""
        return ()
