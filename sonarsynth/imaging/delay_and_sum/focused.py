"""Delay and sum on a lattice, focused: fast, because it is separable."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Literal

from annotated_types import Ge, Le

from sonarsynth.conventions import Floats, PositiveMetres
from sonarsynth.description import description
from sonarsynth.description.method import Demand, FrameSize
from sonarsynth.imaging.delay_and_sum.dense import DenseDelayAndSum
from sonarsynth.imaging.delay_and_sum.fewer_bins import fewer_bins
from sonarsynth.imaging.delay_and_sum.focus_error import MOST_ZONES, zones_needed
from sonarsynth.imaging.delay_and_sum.lattice_image import (
    check_lattice,
    focused_energies,
    steered_zones,
    zoned_energies,
)
from sonarsynth.imaging.image_window import Shading, weights
from sonarsynth.imaging.steering import Steering
from sonarsynth.products import Snapshots
from sonarsynth.receiver import Elements, Sonar

ZONES = (1, 2, 4, 8, 16, 32)
"""Numbers of zones that a plan tries."""
AUTO_ERROR = 0.1
"""dB, by `focus_error`, that zones are chosen for when nobody says how many."""


@description
class FocusedDelayAndSum(Steering):
    """Delay and sum on a lattice; masks, dead elements and weights are free.

    With one zone the delay of focusing is that on the acoustic axis, in every direction. Off the axis it is not quite
    the delay of a sphere: energy lost by a source at the focus, 1.3 m array (508 elements), flat spectrum from 25 to
    85 kHz,

        azimuth, elevation     50 m     20 m     10 m      5 m
        12.5, 12.5 deg         0.00     0.01     0.05     0.25 dB
        25, 0 deg              0.01     0.05     0.19     0.78 dB
        25, 25 deg             0.02     0.16     0.62     2.23 dB

    against 0.3, 1.5 to 1.8, 5 to 6 and 14 dB for plane waves. Rounding: 2e-7 of the brightest beam (241 bins; 1e-6
    for 20 bins, 6e-6 for 300 elements in a row).

    More zones, each with the delay of its own centre (`zones.Zone`), lose less and take longer. Same array and band, 50
    by 50 degrees, 101 by 101 beams, 241 bins; one zone takes 1/435 of the time of `dense` (timed on a tenth of the
    beams). dB for a source at the focus, by `focus_error`: lost at the peak, and wrong within 20 dB of it, an estimate
    that is no bound (see there),

        zones   time      50 m           20 m           10 m           5 m            2 m
            1    1.0   0.03   0.23    0.16   1.29    0.62   3.90    2.23   8.48    6.31  12.25
            2    2.5   0.01   0.11    0.06   0.64    0.25   2.15    0.95   5.58    4.50  11.35
            4    3.5   0.00   0.03    0.02   0.21    0.08   0.90    0.30   2.51    1.58   7.93
            8    6.8   0.00   0.02    0.01   0.10    0.02   0.48    0.08   1.18    0.43   3.98
           16     15   0.00   0.01    0.00   0.05    0.01   0.26    0.02   0.53    0.12   1.90
           24     37   0.00   0.00    0.00   0.03    0.00   0.13    0.01   0.24    0.05   0.81

    Several echoes that interfere can be further wrong where they cancel: 0.12 dB with 8 zones in a frame of the remus
    recipe, 0.53 dB with one.
    """

    kind: Literal["focused"] = "focused"
    focus: PositiveMetres | None = 20.0
    """Range at which the array is focused; left out (none), plane waves."""
    shading: Shading = "uniform"
    """Weights over the aperture: all alike, or falling off towards the rim (lower side lobes, a wider beam)."""
    zones: Annotated[int, Ge(1), Le(32)] | Literal["auto"] = "auto"
    """Zones across the upper and lower edge of the picture, each focused on its own centre; elsewhere as few as are as
    good. Auto: as many as `focus_error` puts at 0.1 dB, or 32 where none do."""
    bins: Literal["few", "all", "auto"] = "auto"
    """Frequencies of the window that energies are summed over: as few as its sound needs, which is shorter (0.01 dB),
    or all. Auto: few in a plan, by the error that it measures; else all."""

    def resolve(self, demand: Demand) -> tuple[FocusedDelayAndSum | DenseDelayAndSum, float]:
        """As many zones as the recipe says; left to the plan, the fewest that err by no more than is allowed (dB)."""
        if demand.exact:
            return self.exact(), 0.0
        few = replace(self, bins="few") if self.bins == "auto" else self
        if self.zones != "auto":
            return few, demand.error(few)
        method, error = replace(few, zones=1), float("inf")
        for zones in ZONES if self.focus is not None else (1,):
            method = replace(few, zones=zones)
            error = demand.error(method)
            if error <= demand.allowed:
                break
        return method, error

    def exact(self) -> DenseDelayAndSum:
        """Every sensor in every beam, with the same focus and weights."""
        return DenseDelayAndSum(focus=self.focus, shading=self.shading)

    def cost(self, size: FrameSize) -> float:
        """As `Method.cost`, of all bins; each zone is an image of its own, of part of the beams."""
        zones = 1.0 if self.zones == "auto" else max(1.25 * self.zones, 1.0)
        return 1.8e-9 * zones * size.beams * size.bins

    def row(self) -> str:
        """Its kind, and the zones where there are several."""
        return f"{self.kind}, {self.zones} zones" if self.zones not in ("auto", 1) else self.kind

    def refusal(self, elements: Elements) -> str:
        """Only lattices are separable."""
        return "" if elements.on_lattice else "'focused' needs an array on a lattice; use 'dense' for other arrays"

    def energies(self, snapshots: Snapshots, elements: Elements, sonar: Sonar) -> Floats:
        """As `Steering.energies`. Raises ValueError for an array that is not a lattice, or when no element is live."""
        check_lattice(elements)
        weight, grid, speed = weights(elements, self.shading), sonar.beams, sonar.assumed_sound_speed
        snapshots = fewer_bins(snapshots, elements.aperture / speed) if self.bins == "few" else snapshots
        spectra, frequency = snapshots.spectra, snapshots.frequency
        zones = self.zones if self.zones != "auto" else self._zones(elements, sonar)
        if zones == 1 or self.focus is None:
            axes = grid.azimuth, grid.elevation
            return snapshots.unit * focused_energies(spectra, elements, weight, frequency, *axes, speed, self.focus)
        cut = steered_zones(elements, self.shading, grid, self.focus, speed, sonar.band, zones)
        return snapshots.unit * zoned_energies(spectra, elements, weight, frequency, grid, speed, cut)

    def _zones(self, elements: Elements, sonar: Sonar) -> int:
        return zones_needed(elements, self.shading, sonar, self.focus, AUTO_ERROR) or MOST_ZONES
