"""Wavefronts over the aperture: delay, gain and direction of each path at a point; plane waves have radius inf."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from sonarsynth.columns import Columns
from sonarsynth.conventions import Bools, Bytes, Floats, Ints
from sonarsynth.products import ArrayExpansion, Arrivals
from sonarsynth.products.array_expansion import QUANTITIES
from sonarsynth.receiver import Elements
from sonarsynth.signals.filtered_pulse import snap_gains
from sonarsynth.state import Emission

MAX_DOPPLER = 0.1
"""Doppler of 0.1 is a closing speed of 75 m/s: more is an error."""

LONGEST_BLUR = 1.0
"""s: a delay_std this long or longer leaves nothing of a snap."""

NEPER = np.log(10.0) / 20.0
"""Np in a dB."""

LONGEST_CORNER = 0.01
"""The corners of a facet are closer to its arrival than this (s): 7 m, there and back."""

FINITE = (
    *("delay", "direction", "amplitude", "absorption", "phase", "delay_std", "doppler"),
    *("corner_delays", "coherent_fraction", "height_delay_std"),
)
"""Columns of arrivals that must be finite, like their expansion."""


@dataclass(frozen=True, eq=False)
class Wavefronts(Columns):
    """Delay, amplitude and direction of paths over the array; amplitudes include the level of the snap."""

    delay: Floats  # (path,) s at the array centre, of the middle of a facet's corners
    direction: Floats  # (path, xyz)
    curvature: Floats  # (path,) 1/m: 1/radius, 0 for a plane wave
    amplitude: Floats  # (path,)
    loss: Floats  # (path,) dB of absorption at the band centre, inside amplitude
    expansion: ArrayExpansion  # (path,)
    occluded: Bytes  # (path, byte) a bit for each hydrophone not reached, after one; (path, 0): all are reached
    family: Ints  # (path,) from 1: those of one family are alike in direction, time and pulse
    modes: Floats  # (path, mode) weights of the modes of a stretch of time (`shapes`); none as yet
    sound_speed: float  # m/s
    aperture: float  # m: no hydrophone is farther out
    attenuation: float  # dB/m at the band centre: for the path to a hydrophone beyond that to the array centre

    @property
    def count(self) -> int:
        """Number of paths."""
        return self.delay.size

    def hidden(self, sensors: int) -> Bools:
        """(path, sensor) hydrophones that each path does not reach; (path, 0) where each reaches all."""
        if not self.occluded.any():
            return np.zeros((self.count, 0), bool)
        return np.unpackbits(self.occluded, axis=1, count=1 + sensors)[:, 1:].astype(bool)

    def select(self, keep: Bools | Ints | Sequence[int] | slice) -> Self:
        """As `Columns.select`; of rows that follow each other nothing is copied."""
        if isinstance(keep, np.ndarray) and keep.dtype != bool and keep.size and (np.diff(keep) == 1).all():
            keep = slice(int(keep[0]), int(keep[-1]) + 1)
        return super().select(keep)

    def without_faint_shadows(self, tolerance: float, elements: Elements) -> Self:
        """The paths, of which the faintest that reach a part of the hydrophones now reach all or none, as is nearer.

        So many are changed as change the energy of all paths by at most `tolerance` squared; in that sum no path counts
        as louder than the loudest that reaches a part. Paths to no hydrophone are left out.
        """
        rows = np.flatnonzero(self.occluded.any(axis=1))
        if not len(rows):
            return self
        missed = np.bitwise_count(self.occluded[rows]).sum(axis=1) / elements.count
        energy = self.amplitude**2 * self.expansion.mean_square(elements.position)
        change = energy[rows] * np.minimum(missed, 1.0 - missed)
        order = np.argsort(change, kind="stable")
        faint = order[np.cumsum(change[order]) <= tolerance**2 * np.minimum(energy, energy[rows].max()).sum()]
        occluded = self.occluded.copy()
        occluded[rows[faint]] = 0
        none = rows[faint[missed[faint] > 0.5]]
        return self.but(occluded=occluded).select(np.delete(np.arange(self.count), none))


@dataclass(frozen=True, eq=False)
class ArrayPaths(Wavefronts):
    """Arrivals in the form that synthesis needs: wavefronts, and the changes of the pulse on each path."""

    phase: Floats  # (path,) rad, -pi/2 to pi/2: whole half turns are signs of the amplitude
    variance: Floats  # (path,) s2: of the Gaussian that the pulse is blurred with
    doppler: Floats  # (path,) the pulse lasts 1 + doppler times as long
    coherent: Bools  # (path,) the pulse is differentiated, i f/centre
    corner_delays: Floats  # (path, 3) s: delays over which the pulse is a mean; their sum is 0
    coherent_fraction: Floats  # (path,) and
    height_delay_std: Floats  # (path,) s: of `facet_pulses.rough_factor`
    centre: float  # Hz, where the amplitudes hold


def array_paths(
    arrivals: Arrivals, snaps: tuple[Emission, ...], elements: Elements, attenuation: float = 0.0
) -> ArrayPaths:
    """The wavefronts of arrivals, in water that absorbs `attenuation` (dB/m) at the band centre; raises ValueError
    where one cannot be synthesised."""
    count = arrivals.delay.size
    expanded = {f"expansion.{name}": getattr(arrivals.expansion, name) for name in QUANTITIES}
    for name, value in ({name: getattr(arrivals, name) for name in FINITE} | expanded).items():
        if not np.isfinite(value).all():
            wrong = ~np.isfinite(value).all(axis=tuple(range(1, value.ndim)))
            raise ValueError(f"arrival {np.flatnonzero(wrong)[0]} has {name} that is not a finite number")
    _check_shapes(arrivals)
    if arrivals.occluded.shape[1] not in (0, 1 + elements.count // 8):
        raise ValueError(f"arrivals are hidden from hydrophones of another array, not of one of {elements.count}")
    if count and not (arrivals.snap.min() >= 0 and arrivals.snap.max() < len(snaps)):
        raise ValueError(f"arrivals name a snap outside 0..{len(snaps) - 1}")
    near = np.flatnonzero(arrivals.radius <= 1.001 * elements.aperture)
    away = elements.position - (arrivals.radius[near, None] * arrivals.direction[near])[:, None]
    touching = (np.linalg.norm(away, axis=2) <= 1e-9 * arrivals.radius[near, None]).any(axis=1)
    if touching.any():
        raise ValueError(f"arrival {near[touching][0]} comes from a hydrophone")
    sign, phase = folded(arrivals.phase)
    delay, corners = _centred(arrivals)
    occluded = arrivals.occluded.copy()
    occluded[:, :1] &= 127  # not whether the centre is reached
    return ArrayPaths(
        delay=delay,
        direction=arrivals.direction,
        curvature=1.0 / arrivals.radius,
        amplitude=arrivals.amplitude * snap_gains(snaps)[arrivals.snap] * sign if count else arrivals.amplitude,
        loss=arrivals.absorption,
        expansion=arrivals.expansion,
        sound_speed=arrivals.sound_speed,
        aperture=elements.aperture or 1.0,
        phase=phase,
        variance=np.minimum(arrivals.delay_std, LONGEST_BLUR) ** 2,
        doppler=arrivals.doppler,
        coherent=arrivals.coherent,
        corner_delays=corners,
        coherent_fraction=arrivals.coherent_fraction,
        height_delay_std=np.minimum(arrivals.height_delay_std, LONGEST_BLUR),
        occluded=occluded,
        family=arrivals.family,
        modes=np.zeros((count, 0)),
        centre=arrivals.centre,
        attenuation=attenuation,
    )


def _centred(arrivals: Arrivals) -> tuple[Floats, Floats]:
    """Delays (path,) of the middle of facets, and those (path, 3) of their corners about it."""
    if not arrivals.corner_delays.any():
        return arrivals.delay, arrivals.corner_delays
    middle = np.einsum("pc->p", arrivals.corner_delays) / 3.0
    return arrivals.delay + middle, arrivals.corner_delays - middle[:, None]


def _check_shapes(arrivals: Arrivals) -> None:
    """Raise ValueError for a path that is silent, comes from nowhere, or whose pulse has no shape."""
    for wrong, fault in (
        (arrivals.amplitude == 0.0, "no amplitude"),
        (~(arrivals.radius > 0.0), "a radius that is not positive"),
        (arrivals.delay_std < 0.0, "a negative delay_std"),
        (np.abs(arrivals.doppler) >= MAX_DOPPLER, f"a Doppler factor that is not within +-{MAX_DOPPLER:g}"),
        (np.abs(arrivals.corner_delays.T) >= LONGEST_CORNER, f"corners that are not within {LONGEST_CORNER:g} s"),
        (np.abs(arrivals.coherent_fraction - 0.5) > 0.5, "a coherent_fraction that is not from 0 to 1"),
        (arrivals.height_delay_std < 0.0, "a negative height_delay_std"),
    ):
        if wrong.any():
            raise ValueError(f"arrival {np.flatnonzero(wrong)[0] % wrong.shape[-1]} has {fault}")
    if arrivals.coherent.any() and not 0.0 < arrivals.centre < np.inf:
        raise ValueError("coherent arrivals need the centre of their band, above 0 Hz")


def folded(phase: Floats) -> tuple[Floats, Floats]:
    """Signs (path,) and phases (path,) from -pi/2 to pi/2 that are together phases of any size; what is a whole number
    of half turns to rounding leaves no phase."""
    if not phase.any():
        return np.ones(phase.size), phase
    turns = np.rint(phase / np.pi)
    remainder = phase - np.pi * turns
    return 1.0 - 2.0 * (turns % 2.0), np.where(np.abs(remainder) > 2e-16 * (1.0 + np.abs(phase)), remainder, 0.0)


def towards(front: Wavefronts, points: Floats) -> tuple[Floats, Floats]:
    """Unit vectors u = (R d - q)/|R d - q| (path, point, xyz) and |R d - q|/R (path, point) at points q (point,
    xyz)."""
    from sonarsynth.equations.kernels.unit_vectors import towards_sources

    u, n = towards_sources(front.direction, front.curvature, points)
    return np.ascontiguousarray(u.transpose(2, 0, 1)), np.ascontiguousarray(n.T)


BENT = 2
"""The first degree of delay terms that turn the wavefront. Linear terms are the motion of the array, which turns no
wave; what that motion adds to the curvature (u/c of it) turns waves too little to matter for a hydrophone's face."""


def tilt(front: Wavefronts, gradient: Floats) -> Floats:
    """Change of the wavefront's direction (point, xyz, path) by delay terms: -c times their gradient (xyz, point,
    term)."""
    bent = front.expansion.first(BENT)
    slope = gradient[:, :, bent:] @ front.expansion.delay[:, bent:].T
    return np.asarray(-front.sound_speed * slope.swapaxes(0, 1))


def arrival_directions(front: Wavefronts, points: Floats, u: Floats | None = None) -> Floats:
    """Slownesses of the wavefronts at points (point, xyz), times the speed of sound at the centre, (path, point, xyz):
    what element faces hear, and the unit vectors u of `towards`, if these are at hand, where rays are straight."""
    u = towards(front, points)[0] if u is None else u
    if not front.expansion.delay.shape[1]:
        return u
    return np.asarray(u + tilt(front, front.expansion.gradient(points, "delay")).transpose(2, 0, 1))


def delay_and_gain(front: Wavefronts, points: Floats) -> tuple[Floats, Floats]:
    """Delay (s) after the array centre, and gain over it at the band centre, (path, point) each."""
    _, n = towards(front, points)
    delay, gain = delays(front, n, points), 1.0 / n
    if front.expansion.amplitude.shape[1]:
        gain = gain * (1.0 + front.expansion.over("amplitude", points))
    if front.attenuation:
        gain = gain * lost(front.attenuation * front.sound_speed * delay)
    return delay, gain


def delays(front: Wavefronts, n: Floats, points: Floats) -> Floats:
    """Delay (s) after the array centre (path, point), from |R d - q|/R (path, point) of `towards`."""
    square = np.einsum("pi,pi->p", points, points)
    # (|R d - q| - R)/c without the difference of nearly equal numbers
    path = (front.curvature[:, None] * square - 2.0 * front.direction @ points.T) / (n + 1.0)
    delay = path / front.sound_speed
    return np.asarray(delay + front.expansion.over("delay", points) if front.expansion.delay.shape[1] else delay)


def lost(level: Floats) -> Floats:
    """Factor on amplitude of a loss of `level` (dB)."""
    return np.asarray(np.exp(-NEPER * level))


def reach(front: Wavefronts) -> Floats:
    """Bound (path,) on how long (s) before or after the array centre a wavefront meets any hydrophone."""
    return np.asarray(front.aperture / front.sound_speed + front.expansion.largest("delay"))


def face_reach(front: Wavefronts, elements: Elements) -> Floats:
    """Bound (path,) on how long (s) before or after the middle of a hydrophone's face a wave meets its edges."""
    turned = front.aperture * front.curvature  # from the array centre to its rim, rad
    y, z = (np.minimum(np.abs(along) + turned, 1.0) for along in front.direction.T[1:])
    return np.asarray(0.5 * elements.face / front.sound_speed * (y + z))


def reference_of(front: Wavefronts, middle: Floats, phase: Floats, variance: Floats) -> Wavefronts:
    """The front that a tile of paths is steered to, from the middle (column,) of their directions, curvatures,
    absorption and delay terms, and the change over the aperture that it takes."""
    norm = np.linalg.norm(middle[:3])
    direction = middle[:3] / norm if norm >= 0.1 else np.array([1.0, 0.0, 0.0])
    delay, none, zero = middle[None, 5 : 5 + front.expansion.delay.shape[1]], np.zeros((1, 0)), np.zeros(1)
    return Wavefronts(
        delay=zero,
        direction=direction[None],
        curvature=middle[3:4],
        amplitude=np.ones(1),
        loss=middle[4:5],
        expansion=front.expansion.but(
            delay=delay, amplitude=none, phase=phase[None], delay_variance=variance[None], error=zero
        ),
        occluded=np.zeros((1, 0), np.uint8),
        family=np.ones(1, int),
        modes=none,
        sound_speed=front.sound_speed,
        aperture=front.aperture,
        attenuation=front.attenuation,
    )
