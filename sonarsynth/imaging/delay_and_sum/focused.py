"""Delay and sum on a lattice, focused: fast, because it is separable."""

from __future__ import annotations

from dataclasses import replace
from math import inf, sin
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
HELPS = 0.7
"""Of the error of an image with few bins, what more subarrays leave of it where they, not the bins, are what errs."""


@description
class FocusedDelayAndSum(Steering):
    """Delay and sum on a lattice; masks, dead elements and weights are free.

    Each quadrant of the picture is two zones, beside the axis and beyond. A zone has the delays of a sphere in its
    middle, and from there to each beam what of them is separable (`zones`). Cut into subarrays, each with delays of its
    own, the array errs by less and takes longer. 1.3 m array of 508 elements, 25 to 85 kHz, 50 by 50 degrees, 101 by
    101 beams, 241 bins: time (3 ms for [1, 1]), and the largest error (dB) within 20 dB of the peak of a source at the
    focus (`focus_error`),

        subarrays    time     50 m     20 m     10 m      5 m      2 m
           [1, 1]     1.0     0.05     0.28     0.95     3.83     9.15
           [2, 2]     3.3     0.01     0.08     0.29     0.74     3.54
           [3, 3]     4.9     0.01     0.02     0.06     0.21     1.09
           [4, 4]     7.7     0.01     0.03     0.05     0.16     0.75
           [6, 6]      14     0.00     0.01     0.02     0.08     0.43

    Rounding: 2e-7 of the brightest beam (241 bins; 1e-6 for 20 bins, 6e-6 for 300 elements in a row). What is left out
    falls as the square of a subarray: 64 by 64 hydrophones 5 cm apart err by 0.5 dB at 20 m in [4, 4].
    Several echoes that interfere can be further wrong where they cancel.
    """

    kind: Literal["focused"] = "focused"
    focus: PositiveMetres | None = 20.0
    """Range at which the array is focused; left out (none), plane waves."""
    shading: Shading = "uniform"
    """Weights over the aperture: all alike, or falling off towards the rim (lower side lobes, a wider beam)."""
    subarrays: tuple[Count, Count] | Literal["auto"] = "auto"
    """Subarrays across and up that the array is cut into, each focused for every beam. Auto: in a plan, the fewest
    whose measured error is allowed; elsewhere, the fewest whose `focus_error` is under 0.1 dB, or 16 each way. Those
    that sound is traced to are `physics.subarrays`."""
    bins: Literal["few", "all", "auto"] = "auto"
    """Frequencies of the window that energies are summed over: as few as sound with silence in it needs (0.007 dB rms,
    0.04 in some frames), or all. Auto: few in a plan, where the error that it measures is allowed; else all."""

    def resolve(self, demand: Demand) -> tuple[FocusedDelayAndSum | DenseDelayAndSum, float]:
        """With the recipe's subarrays and bins; left to the plan, the fewest subarrays that err with few bins by no
        more than is allowed (dB); where more subarrays no longer help, the fewest that do with all. Where none do,
        those that err least."""
        if demand.exact:
            return self.exact(), 0.0
        tried: list[tuple[FocusedDelayAndSum, float]] = []
        for bins in ("few", "all") if self.bins == "auto" else (self.bins,):
            before = inf
            for cut in cuts(demand.elements, self.focus) if self.subarrays == "auto" else [self.subarrays]:
                method = replace(self, subarrays=cut, bins=bins)
                error = demand.error(method)
                tried.append((method, error))
                if error <= demand.allowed:
                    return method, error
                if self.bins == "auto" and bins == "few" and error > HELPS * before:
                    break
                before = error
        return min(tried, key=lambda choice: choice[1])

    def exact(self) -> DenseDelayAndSum:
        """Every sensor in every beam, with the same focus and weights."""
        return DenseDelayAndSum(focus=self.focus, shading=self.shading)

    def cost(self, size: FrameSize) -> float:
        """As `Method.cost`, of all bins."""
        across, up = self.subarrays if isinstance(self.subarrays, tuple) else (1, 1)
        return 0.8e-9 * (across + up) * size.beams * size.bins

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
            snapshots = fewer_bins(snapshots, elements.aperture / speed, widest)
        spectra, frequency = snapshots.spectra, snapshots.frequency
        zones = steered_zones(elements, grid, self.focus, speed, self._cut(elements, sonar))
        return snapshots.unit * lattice_image(spectra, elements, weight, frequency, grid, zones)

    def _cut(self, elements: Elements, sonar: Sonar) -> Subarrays:
        if self.subarrays != "auto":
            return self.subarrays
        return subarrays_for(elements, self.shading, sonar, self.focus) or cuts(elements, self.focus)[-1]
