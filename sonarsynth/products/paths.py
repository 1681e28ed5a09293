"""Sound on its way: rays between points, and all paths of a frame as they reach the array."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any

import numpy as np
import numpy.typing as npt

from sonarsynth.columns import Columns
from sonarsynth.conventions import Bools, Bytes, Floats, Ints
from sonarsynth.products.array_expansion import ArrayExpansion


@dataclass(frozen=True, eq=False)
class Paths(Columns):
    """Rays that join pairs of points in the water, from a propagation model. World frame.

    A pair may have no path (a shadow zone) or several; paths are sorted by pair, then by travel time.
    """

    pair: Ints  # (path,) which pair of end points
    travel_time: Floats  # (path,) s
    length: Floats  # (path,) m, along the ray
    departure: Floats  # (path, xyz) unit vector of travel where the ray starts
    arrival: Floats  # (path, xyz) unit vector of travel where it ends
    spreading: Floats  # (path,) 1/m: geometric amplitude re 1 m from the source (1/r in isovelocity water)
    surface: Ints  # (path,) number of surface reflections
    bottom: Ints  # (path,) number of bottom reflections
    turning: Ints  # (path,) number of turning points
    caustics: Ints  # (path,) caustics passed
    surface_grazing: Floats  # (path,) rad: grazing angle at the surface; NaN without a reflection there
    bottom_grazing: Floats  # (path,) rad: grazing angle at the bottom; NaN without a reflection there
    flag: Ints  # (path,) 0 good; else why ray theory ends here (`ray_solutions.REASONS`)


DIRECT = "direct"
FAMILIES = (DIRECT, "surface", "bottom", "surface and bottom")
"""Families of paths: by which boundaries they touched."""


class Kind(IntEnum):
    """What an arrival met on its way."""

    DIRECT = 0
    """From the source to the array, by surface and bottom or not: it met no target."""
    ECHO = 1
    """Scattered by a facet of a target."""
    FORWARD = 2
    """The shadow of a facet that scatters forward: with the direct wave, it is what is heard behind the target."""
    REVERBERATION = 3
    """Scattered by surface, bottom or what floats in the water."""


@dataclass(frozen=True, eq=False)
class Arrivals(Columns):
    """Every path of a frame as it reaches the array. xyz: in the sonar frame, but for `point`.

    geometry
    tau         delay (path,)                     s    at the array centre, time of the emission included
    d           direction (path, xyz)             1    from the array centre to where the path seems to come from
    R           radius (path,)                    m    of curvature of the reference sphere
    L           length (path,)                    m    of the whole path
    x           point (path, xyz)                 m    world: of the facet where the sound met it; of the source
    amplitude   at the centre of the band
    A           amplitude (path,)                 1/m  s_out f s_in V 10^(-a/20): pressure over the source's at 1 m
    s_out       spreading_out (path,)             1/m  source to facet (or array), with the source's directivity
    f           scattering (path,)                m    far-field amplitude of the facet, signed (1 of direct paths)
    s_in        spreading_in (path,)              1/m  facet to array (1 of direct paths)
    V           boundary (path,)                  1    moduli of reflection, multiplied; times -1 for a phase of pi
    a           absorption (path,)                dB   along the whole path
                occluded (path, byte)             bits a body hides it from the centre, from each hydrophone; none: 0
    pulse       spectrum S(f): times exp(i phi) exp(-(2 pi f sigma)^2/2) facet_response(f), of p((t - tau)/(1 + delta))
    phi         phase (path,)                     rad  of caustics and lossy reflections, at all frequencies
    sigma       delay_std (path,)                 s    of roughness, as a Gaussian in time
    sigma_f     echo_delay_std (path,)            s    the facet's part of it: squares of both parts add up
    delta       doppler (path,)                   1    how much longer the pulse lasts
                coherent (path,)                  bool differentiated, i f/f_c, of smooth facets; phases count in sums
    t_1..3      corner_delays (path, 3)           s    of the facet about tau, a mean over it; 0: a point
    w           coherent_fraction (path,)         1    of the power that is coherent where the facet is smooth
    sigma_h     height_delay_std (path,)          s    of its heights: sqrt(1 - w exp(-(2 pi f sigma_h)^2)); w = 0: all
    array       expansion (path,)                     `ArrayExpansion`: beside the array centre, at each sensor
    provenance
                kind (path,)                           `Kind`
                snap (path,)                           index of the emission
                target (path,)                         index of the target, -1 of direct paths
                facet (path,)                          index in the mesh of the target, -1 of direct paths
                surface, bottom (path,)                reflections there
                turning, caustics (path,)              turning points and caustics passed
                lit_by (path,)                         index into FAMILIES: boundaries touched on the way to the target
                arrives_by (path,)                     index into FAMILIES: boundaries touched on the way to the array

    Water absorbs on what the way to a sensor is longer by, its delay times c, as it does on the way to the array
    centre: synthesis takes that off at each frequency. What a facet makes of the pulse is that at the centre. The
    modulus of `facet_pulses.facet_response` is 1 at f_c for a coherent facet that is small.
    """

    delay: Floats
    direction: Floats
    radius: Floats
    length: Floats
    point: Floats
    amplitude: Floats
    spreading_out: Floats
    scattering: Floats
    spreading_in: Floats
    boundary: Floats
    absorption: Floats
    occluded: Bytes
    phase: Floats
    delay_std: Floats
    echo_delay_std: Floats
    doppler: Floats
    coherent: Bools
    corner_delays: Floats
    coherent_fraction: Floats
    height_delay_std: Floats
    expansion: ArrayExpansion
    kind: npt.NDArray[np.int8]
    snap: Ints
    target: Ints
    facet: Ints
    surface: Ints
    bottom: Ints
    turning: Ints
    caustics: Ints
    lit_by: Ints
    arrives_by: Ints
    centre: float  # f_c, Hz: centre of the band, where amplitudes hold
    sound_speed: float  # c, m/s of the water at the array centre
    amplitude_error: float = 0.0  # largest error of the expansion's amplitudes at its probes, over the strongest echo

    @property
    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """All that paths have, by name; what they have over the aperture too."""
        named = {**vars(self), **{f"expansion.{name}": value for name, value in vars(self.expansion).items()}}
        return {name: value for name, value in named.items() if isinstance(value, np.ndarray)}

    @property
    def wavefront_error(self) -> float:
        """Largest error (s) of the expansion, but for amplitudes, at its probes."""
        return float(self.expansion.error.max(initial=0.0))

    def hidden(self, sensors: int) -> Bools:
        """(path, sensor) hydrophones that a body hides each path from; (path, 0) where none is hidden anywhere."""
        bits = np.unpackbits(self.occluded, axis=1, count=1 + sensors if self.occluded.shape[1] else None)
        return bits[:, 1:].astype(bool)

    def for_sensors(self, rows: Ints, sensors: int) -> Arrivals:
        """The same for some (row,) of so many hydrophones, in another order perhaps."""
        if not self.occluded.shape[1]:
            return self
        bits = np.unpackbits(self.occluded, axis=1, count=1 + sensors)
        return replace(self, occluded=np.packbits(bits[:, np.append(0, 1 + rows)], axis=1))

    @property
    def seen_from_centre(self) -> Arrivals:
        """The paths that reach the centre of the array, as if all hydrophones saw what it sees."""
        if not self.occluded.shape[1]:
            return self
        return self.but(occluded=self.occluded[:, :0]).select(self.occluded[:, 0] < 128)

    @property
    def without_reverberation(self) -> Arrivals:
        """The paths of the source and of targets: those that levels and labels are about."""
        apart = self.kind == Kind.REVERBERATION
        return self.select(~apart) if apart.any() else self

    @property
    def family(self) -> Ints:
        """(path,) from 1: by the boundaries touched on both ways, and where by both, whether it comes from above."""
        above = (self.arrives_by == 3) & (self.direction[:, 2] > 0.0)
        return np.asarray(1 + 4 * self.lit_by + self.arrives_by + 16 * above)

    @property
    def direct(self) -> Bools:
        """(path,) true for paths that met no target."""
        return np.asarray(self.kind == Kind.DIRECT)
