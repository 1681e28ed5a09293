"""Sub-bands: what is bright in all of them is an echo, what is bright in some is a grating lobe."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Le

from sonarsynth.conventions import Floats, PositiveMetres
from sonarsynth.description import description
from sonarsynth.description.method import FrameSize
from sonarsynth.imaging.delay_and_sum.auto_beamformer import AutoBeamforming
from sonarsynth.imaging.delay_and_sum.focused import FocusedDelayAndSum
from sonarsynth.imaging.image_window import Shading, weights
from sonarsynth.imaging.steering import Steering
from sonarsynth.products import Snapshots
from sonarsynth.receiver import Elements, Sonar


@description
class SubBand(Steering):
    """The geometric mean of delay-and-sum images of parts of the band, against the grating lobes of a lattice.

    With E_b the energy of a beam in sub-band b and S_b the mean energy of a live sensor there, S = sum S_b,

        E = S exp(sum_b (S_b/S) ln(E_b/S_b)).

    A plane wave in a steered direction has E_b = S_b whatever its spectrum: it keeps its energy. Nowhere is there more
    than in delay and sum, by Jensen's inequality. For a flat spectrum this is the geometric mean of the sub-bands times
    their number. A grating lobe moves with frequency and is in a few sub-bands only. Of sources of different spectra a
    part is lost in each: the weights are those of their sum.

    Takes the time of delay and sum, and a little more. Echoes are picked from beams of delay and sum.
    """

    kind: Literal["sub_band"] = "sub_band"
    focus: PositiveMetres | None = 20.0
    """Range at which the array is focused; left out (none), plane waves."""
    shading: Shading = "uniform"
    """Weights over the aperture: all alike, or falling off towards the rim (lower side lobes, a wider beam)."""
    bands: Annotated[int, Ge(1), Le(64)] = 8
    """Parts of equal width that the band is cut into; no more than the window has frequencies."""

    def cost(self, size: FrameSize) -> float:
        """As `Method.cost`: a little more than delay and sum."""
        return FocusedDelayAndSum(subarrays=(2, 2)).cost(size)

    def row(self) -> str:
        """Its kind, and the number of sub-bands."""
        return f"{self.kind}, {self.bands} bands"

    def energies(self, snapshots: Snapshots, elements: Elements, sonar: Sonar) -> Floats:
        """As `Steering.energies`."""
        plain = AutoBeamforming(focus=self.focus, shading=self.shading).chosen(elements, sonar)
        gain = weights(elements, self.shading)
        bins = len(snapshots.frequency)
        bands = [snapshots.select(block) for block in np.array_split(np.arange(bins), min(self.bands, bins))]
        images = np.stack([plain.energies(band, elements, sonar) for band in bands])
        received = np.array([band.unit * band.power(gain).sum() for band in bands])
        return weighted_geometric_mean(images, received)


def weighted_geometric_mean(energy: Floats, reference: Floats) -> Floats:
    """S exp(sum_b (S_b/S) ln(E_b/S_b)), S = sum_b S_b: (...), from energies E (band, ...) and references S (band,).

    Energies are not negative. Bands whose reference is zero count nothing; without any the mean is zero.
    Source: the geometric mean with weights, e.g. Hardy, Littlewood & Polya (1934), Inequalities, section 2.2.
    """
    used = reference != 0.0
    if not used.any():
        return np.zeros(energy.shape[1:])
    total = reference.sum()
    with np.errstate(divide="ignore"):  # no energy in a band: the mean is zero
        logarithm = np.log(energy[used] / reference[used].reshape(-1, *[1] * (energy.ndim - 1)))
    return np.asarray(total * np.exp(np.tensordot(reference[used] / total, logarithm, axes=1)))
