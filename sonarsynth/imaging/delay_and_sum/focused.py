"""Delay and sum on a lattice, focused: fast, because it is separable."""

from __future__ import annotations

from dataclasses import replace
from math import sin
from typing import Annotated, Literal

from annotated_types import Ge, Le

from sonarsynth.conventions import Floats, PositiveMetres
from sonarsynth.description import description
from sonarsynth.description.method import Demand, FrameSize
from sonarsynth.imaging.delay_and_sum.dense import DenseDelayAndSum
from sonarsynth.imaging.delay_and_sum.fewer_bins import fewer_bins
from sonarsynth.imaging.delay_and_sum.focus_error import subarrays_for
from sonarsynth.imaging.delay_and_sum.lattice_image import (
    check_lattice,
    lattice_image,
    steered_zones,
)
from sonarsynth.imaging.delay_and_sum.zones import Subarrays, cuts
from sonarsynth.imaging.image_window import Shading, weights
from sonarsynth.imaging.steering import Steering
from sonarsynth.products import Snapshots
from sonarsynth.receiver import Elements, Sonar

Count = Annotated[int, Ge(1), Le(16)]


@description
class FocusedDelayAndSum(Steering):
    """Delay and sum on a lattice; masks, dead elements and weights are free.

    With the delays of the acoustic axis in every direction (`subarrays: axis`), which off the axis are not quite those
    of a sphere, a source at the focus loses (1.3 m array of 508 elements, flat spectrum from 25 to 85 kHz)

        azimuth, elevation     50 m     20 m     10 m      5 m
        12.5, 12.5 deg         0.00     0.01     0.05     0.25 dB
        25, 0 deg              0.01     0.05     0.19     0.78 dB
        25, 25 deg             0.02     0.16     0.62     2.23 dB

    against 0.3, 1.5 to 1.8, 5 to 6 and 14 dB for plane waves. Rounding: 2e-7 of the brightest beam (241 bins; 1e-6
    for 20 bins, 6e-6 for 300 elements in a row).

    Cut into subarrays, each with the delays of a sphere about its own middle (`zones.Lens`), it errs by less and takes
    longer. Same array and band, 50 by 50 degrees, 101 by 101 beams, 241 bins: time, and the largest error (dB) within
    20 dB of the peak of a source at the focus (`focus_error`),

        subarrays    time     50 m     20 m     10 m      5 m      2 m
             axis     1.0     0.10     0.87     3.23     8.03    14.05
           [1, 1]     1.9     0.04     0.25     1.35     3.95     8.48
           [2, 2]     5.2     0.03     0.16     0.58     2.39     5.80
           [3, 3]     8.0     0.01     0.03     0.07     0.32     3.65
           [4, 4]      12     0.02     0.05     0.08     0.21     2.34
           [6, 6]      22     0.00     0.01     0.04     0.12     0.56

    What is left out falls as the square of a subarray: 64 by 64 hydrophones 5 cm apart err by 1.0 dB at 20 m in [4, 4].
    Several echoes that interfere can be further wrong where they cancel.
    """

    kind: Literal["focused"] = "focused"
    focus: PositiveMetres | None = 20.0
    """Range at which the array is focused; left out (none), plane waves."""
    shading: Shading = "uniform"
    """Weights over the aperture: all alike, or falling off towards the rim (lower side lobes, a wider beam)."""
    subarrays: tuple[Count, Count] | Literal["axis", "auto"] = "auto"
    """Subarrays across and up that the array is cut into, each focused for every beam; `axis`: none, the delay of the
    acoustic axis in all directions. Auto: in a plan, the fewest whose measured error is allowed; elsewhere, the fewest
    whose `focus_error` is under 0.1 dB, or 16 each way."""
    bins: Literal["few", "all", "auto"] = "auto"
    """Frequencies of the window that energies are summed over: as few as its sound needs, which is shorter (0.01 dB),
    or all. Auto: few in a plan, by the error that it measures; else all."""

    def resolve(self, demand: Demand) -> tuple[FocusedDelayAndSum | DenseDelayAndSum, float]:
        """With the recipe's subarrays; left to the plan, the fewest that err by no more than is allowed (dB)."""
        if demand.exact:
            return self.exact(), 0.0
        few = replace(self, bins="few") if self.bins == "auto" else self
        if self.subarrays != "auto":
            return few, demand.error(few)
        method, error = few, float("inf")
        for cut in cuts(demand.elements, self.focus):
            method = replace(few, subarrays=cut)
            error = demand.error(method)
            if error <= demand.allowed:
                break
        return method, error

    def exact(self) -> DenseDelayAndSum:
        """Every sensor in every beam, with the same focus and weights."""
        return DenseDelayAndSum(focus=self.focus, shading=self.shading)

    def cost(self, size: FrameSize) -> float:
        """As `Method.cost`, of all bins: in units of an image with the delays of the axis."""
        across, up = self.subarrays if isinstance(self.subarrays, tuple) else (0, 0)
        images = 1.0 + across if across * up < 2 else 2.0 + across + up
        return 1.8e-9 * images * size.beams * size.bins

    def row(self) -> str:
        """Its kind, and the subarrays where there are some."""
        cut = self.subarrays
        return f"{self.kind}, {cut[0]} x {cut[1]} subarrays" if isinstance(cut, tuple) else self.kind

    def refusal(self, elements: Elements) -> str:
        """Only lattices are separable."""
        return "" if elements.on_lattice else "'focused' needs an array on a lattice; use 'dense' for other arrays"

    def energies(self, snapshots: Snapshots, elements: Elements, sonar: Sonar) -> Floats:
        """As `Steering.energies`. Raises ValueError for an array that is not a lattice, or when no element is live."""
        check_lattice(elements)
        weight, grid, speed = weights(elements, self.shading), sonar.beams, sonar.assumed_sound_speed
        if self.bins == "few":
            widest = sin(0.5 * max(grid.azimuth_span, grid.elevation_span))
            snapshots = fewer_bins(snapshots, widest * elements.aperture / speed)
        spectra, frequency = snapshots.spectra, snapshots.frequency
        cut = steered_zones(elements, self.shading, grid, self.focus, speed, sonar.band, self._cut(elements, sonar))
        return snapshots.unit * lattice_image(spectra, elements, weight, frequency, grid, cut)

    def _cut(self, elements: Elements, sonar: Sonar) -> Subarrays:
        if self.focus is None:
            return "axis"
        if self.subarrays != "auto":
            return self.subarrays
        return subarrays_for(elements, self.shading, sonar, self.focus) or cuts(elements, self.focus)[-1]
