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
from sonarsynth.imaging.delay_and_sum.focus_error import PARTS, parts_needed
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

AUTO_ERROR = 0.1
"""dB, by `focus_error`, that parts are chosen for when nobody says how many."""


@description
class FocusedDelayAndSum(Steering):
    """Delay and sum on a lattice; masks, dead elements and weights are free.

    Without parts the delay of focusing is that on the acoustic axis, in every direction. Off the axis it is not quite
    the delay of a sphere: energy lost by a source at the focus, 1.3 m array (508 elements), flat spectrum from 25 to
    85 kHz,

        azimuth, elevation     50 m     20 m     10 m      5 m
        12.5, 12.5 deg         0.00     0.01     0.05     0.25 dB
        25, 0 deg              0.01     0.05     0.19     0.78 dB
        25, 25 deg             0.02     0.16     0.62     2.23 dB

    against 0.3, 1.5 to 1.8, 5 to 6 and 14 dB for plane waves. Rounding: 2e-7 of the brightest beam (241 bins; 1e-6
    for 20 bins, 6e-6 for 300 elements in a row).

    Cut into parts, each with the delays of a sphere about its own middle (`zones.Lens`), it loses less and takes
    longer. Same array and band, 50 by 50 degrees, 101 by 101 beams, 241 bins; without parts it takes 1/435 of the time
    of `dense` (timed on a tenth of the beams). dB for a source at the focus, by `focus_error`: lost at the peak, and
    wrong within 20 dB of it, an estimate that is no bound (see there),

        parts   time      50 m           20 m           10 m           5 m            2 m
            0    1.0   0.03   0.23    0.16   1.29    0.62   3.90    2.23   8.48    6.31  12.25
            1    2.5   0.01   0.11    0.06   0.64    0.25   2.15    0.95   5.58    4.50  11.35
            2    7.2   0.00   0.02    0.02   0.12    0.07   0.51    0.28   1.35    1.57   8.66
            3     12   0.00   0.02    0.01   0.08    0.03   0.23    0.12   0.57    0.69   3.54
            4     19   0.00   0.01    0.00   0.04    0.02   0.15    0.08   0.37    0.43   2.12
            6     38   0.00   0.01    0.00   0.02    0.01   0.06    0.04   0.20    0.20   0.74

    What is left out falls as the square of a part: 64 by 64 hydrophones 5 cm apart need 4 parts for what 26 by 26 need
    one for, and ten times the time of no parts. Several echoes that interfere can be further wrong where they cancel.
    """

    kind: Literal["focused"] = "focused"
    focus: PositiveMetres | None = 20.0
    """Range at which the array is focused; left out (none), plane waves."""
    shading: Shading = "uniform"
    """Weights over the aperture: all alike, or falling off towards the rim (lower side lobes, a wider beam)."""
    parts: Annotated[int, Ge(0), Le(16)] | Literal["auto"] = "auto"
    """Parts along each axis that the array is cut into, each focused for every beam; 0: the delay of the acoustic axis
    in all directions. Auto: as many as `focus_error` puts at 0.1 dB, or 16 where none do."""
    bins: Literal["few", "all", "auto"] = "auto"
    """Frequencies of the window that energies are summed over: as few as its sound needs, which is shorter (0.01 dB),
    or all. Auto: few in a plan, by the error that it measures; else all."""

    def resolve(self, demand: Demand) -> tuple[FocusedDelayAndSum | DenseDelayAndSum, float]:
        """As many parts as the recipe says; left to the plan, the fewest that err by no more than is allowed (dB)."""
        if demand.exact:
            return self.exact(), 0.0
        few = replace(self, bins="few") if self.bins == "auto" else self
        if self.parts != "auto":
            return few, demand.error(few)
        method, error = few, float("inf")
        for parts in PARTS if self.focus is not None else (0,):
            method = replace(few, parts=parts)
            error = demand.error(method)
            if error <= demand.allowed:
                break
        return method, error

    def exact(self) -> DenseDelayAndSum:
        """Every sensor in every beam, with the same focus and weights."""
        return DenseDelayAndSum(focus=self.focus, shading=self.shading)

    def cost(self, size: FrameSize) -> float:
        """As `Method.cost`, of all bins: in units of an image with the delays of the axis."""
        parts = 0 if self.parts == "auto" else self.parts
        images = 1.0 + parts if parts < 2 else 2.0 + 2.0 * parts
        return 1.8e-9 * images * size.beams * size.bins

    def row(self) -> str:
        """Its kind, and the parts where there are some."""
        return f"{self.kind}, {self.parts} x {self.parts} parts" if self.parts not in ("auto", 0) else self.kind

    def refusal(self, elements: Elements) -> str:
        """Only lattices are separable."""
        return "" if elements.on_lattice else "'focused' needs an array on a lattice; use 'dense' for other arrays"

    def energies(self, snapshots: Snapshots, elements: Elements, sonar: Sonar) -> Floats:
        """As `Steering.energies`. Raises ValueError for an array that is not a lattice, or when no element is live."""
        check_lattice(elements)
        weight, grid, speed = weights(elements, self.shading), sonar.beams, sonar.assumed_sound_speed
        snapshots = fewer_bins(snapshots, elements.aperture / speed) if self.bins == "few" else snapshots
        spectra, frequency = snapshots.spectra, snapshots.frequency
        parts = self.parts if self.parts != "auto" else self._parts(elements, sonar)
        if parts == 0 or self.focus is None:
            axes = grid.azimuth, grid.elevation
            return snapshots.unit * focused_energies(spectra, elements, weight, frequency, *axes, speed, self.focus)
        cut = steered_zones(elements, self.shading, grid, self.focus, speed, sonar.band, parts)
        return snapshots.unit * zoned_energies(spectra, elements, weight, frequency, grid, speed, cut)

    def _parts(self, elements: Elements, sonar: Sonar) -> int:
        needed = parts_needed(elements, self.shading, sonar, self.focus, AUTO_ERROR)
        return PARTS[-1] if needed is None else needed
