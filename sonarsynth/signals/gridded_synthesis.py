"""The fast synthesis: paths are deposited with a kernel on a fine grid, and everything else is done in the frequency
domain."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from typing import Annotated, Any, Final, Literal

import numpy as np
import numpy.typing as npt
from annotated_types import Ge, Gt, Le, Lt, MultipleOf

from sonarsynth.conventions import Ints, Number
from sonarsynth.description import description
from sonarsynth.description.method import Demand, FrameSize
from sonarsynth.products import Arrivals, LateSegment, LateSignals, Signals
from sonarsynth.receiver import stop_frequency
from sonarsynth.signals.array_paths import ArrayPaths, array_paths, reach
from sonarsynth.signals.direct_sum import UnroundedSynthesis, attenuation
from sonarsynth.signals.gridded.bins import bins_of
from sonarsynth.signals.gridded.deposit import Waves, add, prepared
from sonarsynth.signals.gridded.tiles import FEW
from sonarsynth.signals.pulse_variation import from_the_sharpest
from sonarsynth.signals.segments import GUARD, Reception, Segment, layout, overlapping
from sonarsynth.state import Emission

ROUNDING: Final[dict[str, float]] = {"float32": 3e-6, "float64": 1e-9}
"""Relative error by the precision of the grid and of its table of the kernel."""
ERROR_OVER_TOLERANCE = 0.75
"""Error of the signals over the tolerance of each other approximation of `GriddedSynthesis`, at most: 0.7 was seen of
one in 60 random sets of paths of one sign, heard by 15 to 35 hydrophones, 0.25 of a hull (its table)."""
NARROW_BAND, NARROW_BAND_KERNEL, NARROW_BAND_OTHERS = 10e3, 6.0, 1.5
"""Hz: in narrower bands the paths of an echo may cancel each other wherever it is heard. The kernel and the other
approximations then err by so many times as much of its peak, as measured."""


def kernel_error(width: int, oversampling: float, bandwidth: float = np.inf) -> float:
    """Error of spreading a path over so many samples: 2 exp(-pi width sqrt(1 - 1/oversampling)), over the peak of an
    echo in a band (Hz).

    Source: Barnett, Magland and af Klinteberg (2019), SIAM J. Sci. Comput. 41, C479, eq. 1.8 (their kernel; ours has
    the same decay).
    """
    error = float(2.0 * np.exp(-np.pi * width * np.sqrt(1.0 - 1.0 / oversampling)))
    return error * (NARROW_BAND_KERNEL if bandwidth < NARROW_BAND else 1.0)


def error_over_tolerance(bandwidth: float = np.inf) -> float:
    """`ERROR_OVER_TOLERANCE` in a band (Hz)."""
    return ERROR_OVER_TOLERANCE * (NARROW_BAND_OTHERS if bandwidth < NARROW_BAND else 1.0)


def deposit_error(method: GriddedSynthesis, bandwidth: float = np.inf) -> float:
    """Error of echoes in a band (Hz) relative to their peak, a bound on what was measured (the tables of
    `GriddedSynthesis`)."""
    kernel = kernel_error(method.width, method.oversampling, bandwidth)
    return kernel + error_over_tolerance(bandwidth) * method.tolerance + ROUNDING[method.precision]


@dataclass(frozen=True)
class _FewPaths:
    """Few paths of a stretch, the same as others where all that is known of them is: in each frame of a still snap."""

    known: tuple[Any, ...]
    waves: Callable[[], Waves] = field(compare=False)

    @staticmethod
    def of(method: GriddedSynthesis, span: Segment, paths: ArrayPaths, reception: Reception) -> _FewPaths:
        """As `GriddedSynthesis.waves` has them."""
        tables = paths.but(expansion=None), paths.expansion, replace(span, paths=span.paths[:0])
        held = [value for table in tables for value in vars(table).values()]
        known = (value.tobytes() if isinstance(value, np.ndarray) else value for value in held)
        return _FewPaths((method, reception, *known), partial(method.waves, span, paths, reception))


@lru_cache(maxsize=4)
def waves_of_few(few: _FewPaths) -> Waves:
    """The waves of few paths."""
    made = tuple(few.waves()())
    return lambda: made


@description
class GriddedSynthesis(UnroundedSynthesis):
    """Synthesis by a Kaiser-Bessel kernel, Chebyshev nodes over the aperture and polynomial directivity.

    Measured: 508 hydrophones with faces, 2000 echoes of a body of 1.6 m and the direct snap, absorption; largest error
    over the peak of the echoes, against `DirectSum`, and time of one core (2.6 GHz Zen 4, shared), by distance:

        width  tolerance  precision |  20 m            |  5 m
        4      2e-3       float32   |  1.5e-3   6.0 ms |  1.4e-3    20 ms
        6      1e-3       float32   |  2.4e-4   5.6 ms |  2.5e-4    24 ms
        6      4e-4       float32   |  1.5e-4   6.8 ms |  6.5e-5    29 ms
        6      1.5e-4     float32   |  2.1e-5   8.5 ms |  3.6e-5    36 ms   (default)
        6      5e-5       float32   |  1.9e-5   8.9 ms |  2.5e-5    46 ms
        8      2e-5       float32   |  3.3e-6    11 ms |  4.9e-6    58 ms
        8      2e-6       float64   |  5.2e-7    27 ms |  6.2e-7   280 ms
        DirectSum                   |          130 s   |            76 s

    Pulses that differ in shape: 2000 direct echoes and 5000 by surface and bottom, all with absorption; largest error,
    and time over that of the same paths with plain pulses (turn about, on a core that others shared), at 20 m | at 8 m:

        plain                         |  2.1e-5   1          |  4.5e-5   1
        phases spread by +-1 rad      |  1.6e-5   1.2 - 1.6  |  4.7e-5   1.2
        and blurs of 0 to 17 us       |  1.7e-5   1.7 - 2.3  |  4.8e-5   1.3
        and stretches within +-3e-3   |  1.8e-5   1.9 - 2.9  |  4.6e-5   1.5

    Pulses that facets reshape: 18 000 facets of 7 mm of a body of 1.6 m by 0.2 m at 20 m, with absorption; largest
    error over the peak of the echo, which is a hundredth of the sum of those of the coherent facets:

        plain                                     |  4.5e-5   20 ms
        smooth: differentiated, mean over corners |  1.7e-5   38 ms
        and blurs of 1 to 2 us                    |  1.9e-5   49 ms
        rough: what is missing from that          |  6.6e-5   37 ms

    Point hydrophones take 4.9 ms and 11 ms. The error of echoes of 40 to 250 facets of a REMUS-100, lobes of 3 to 30
    degrees, at 5, 10 and 20 m: at most 7e-5. Errors include what the support of the pulse leaves out (1e-7 of its
    peak).
    """

    kind: Literal["kernel_deposit"] = "kernel_deposit"
    width: Annotated[int, Ge(4), Le(16), MultipleOf(2)] = 6
    """Samples that a path is spread over: that alone errs by 4e-5 (6), 1e-6 (8), 3e-8 (10), whatever the tolerance; in
    bands under 10 kHz, where the paths of an echo cancel each other, by up to 6 times as much of its peak, as plans
    say."""
    oversampling: Annotated[Number, Ge(1.2), Le(8)] = 1.5
    """Rate of the grid over twice the highest frequency."""
    precision: Literal["float32", "float64"] = "float32"
    """Precision of the arrays that pulses are summed in."""
    tolerance: Annotated[Number, Gt(0), Lt(0.1)] = 1.5e-4
    """Error allowed to each of the other approximations, relative to what a path gives: nodes along each axis of the
    aperture, terms of directivity and of absorption; the quiet ends of the spectrum get 3 % of it each, over the
    coherent gain of paths of one sign."""

    def resolve(self, demand: Demand) -> tuple[GriddedSynthesis, float]:
        """Itself, and the bound on what it errs by, relative to the peak of an echo."""
        return self, deposit_error(self, demand.bandwidth)

    def cost(self, size: FrameSize) -> float:
        """As `Method.cost`: the wider a target, the more nodes over the array, and tiles."""
        per_path = 1.0e-9 + 3.6e-6 * size.solid_angle
        return size.paths * size.sensors * per_path + 4.5e-9 * size.sensors * size.samples

    def row(self) -> str:
        """Its kind and what it is set to."""
        return (
            f"{self.kind}, width {self.width} x {self.oversampling:g}, tolerance {self.tolerance:.1g}, {self.precision}"
        )

    def pressure(
        self, arrivals: Arrivals, snaps: tuple[Emission, ...], reception: Reception
    ) -> tuple[npt.NDArray[Any], int]:
        """As `UnroundedSynthesis.pressure`: silence, and stretches of it that hold whole pulses."""
        late: Any = self.signals(arrivals, snaps, reception._replace(whole=True))
        return late.total(), late.outside

    def signals(self, arrivals: Arrivals, snaps: tuple[Emission, ...], reception: Reception) -> Signals:
        """As `SignalSynthesis.signals`, with all made but for the sums at the hydrophones."""
        elements, sonar, absorption, start, samples, whole, still = reception
        front = array_paths(arrivals, snaps, elements, attenuation(absorption, sonar.band.centre))
        front = from_the_sharpest(front, stop_frequency(sonar.antialias))
        plan = layout(arrivals, front, snaps, reception, tolerance=0.01 * self.tolerance)
        rate = sonar.sampling_frequency
        apart = int(np.ceil(reach(front).max(initial=0.0) * rate)) + 2 * GUARD  # any hydrophone from the centre
        ends = [(span.first - apart, span.first + span.samples + apart) for span in plan.stretches] or [(0, apart)]
        first, stop = np.clip(np.array(ends).T, 0, samples)
        low, high = (0, samples) if whole else (int(first.min()), int(stop.max()))
        waves: list[Waves] = []
        for span in plan.stretches:
            paths = front.select(span.paths)
            known = _FewPaths.of(self, span, paths, reception) if still and paths.count <= FEW else None
            waves.append(waves_of_few(known) if known else self.waves(span, paths, reception))

        def summed(some: Ints) -> LateSegment:
            def add_all(out: npt.NDArray[Any], begin: int) -> None:
                for n in some:
                    add(out, low + begin, waves[n])

            return int(first[some].min()) - low, int(stop[some].max()) - low, add_all

        segments = [summed(some) for some in overlapping(np.arange(len(waves)), first, stop)]
        shape, late = (elements.count, high - low), start + low / rate
        columns = {"start": late, "sampling_frequency": rate, "outside": plan.outside}
        return LateSignals.of(segments, shape, self.precision, **columns)

    def waves(self, span: Segment, paths: ArrayPaths, reception: Reception) -> Waves:
        """The waves of the paths of a stretch."""
        sonar, method = reception.sonar, (self.width, self.oversampling, self.precision, self.tolerance)
        paths, bins = bins_of(span, paths, sonar, reception.absorption, self.tolerance)
        origin, stop = reception.start + span.first / sonar.sampling_frequency, stop_frequency(sonar.antialias)
        return prepared(span, paths, reception.elements, bins, origin=origin, stop=stop, method=method)
