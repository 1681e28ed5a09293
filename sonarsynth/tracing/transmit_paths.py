"""Arrivals put together from both halves of their paths: out to the facet, and back to the array."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from sonarsynth.columns import Columns, alike, picked
from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.products import ArrayExpansion, Arrivals, Kind, Paths
from sonarsynth.products.array_expansion import stacked
from sonarsynth.propagation.reflections import Reflections, as_sign
from sonarsynth.scattering.facet_geometry import PulseResponse
from sonarsynth.state import Emission
from sonarsynth.tracing.receive_paths import ReceivePaths

SILENCE = 1e-12
"""Sound of a snap and of its image that cancel to less than this share of what both are alone is left out."""


@dataclass(frozen=True, eq=False)
class TransmitPaths(Columns):
    """Ways from a snap to facets."""

    facet: Ints  # (way,) which facet
    family: Ints  # (way,) as `images.family`; of a snap's own image in the boundary it lies on: as of the snap
    departure: Floats  # (way, xyz) world
    arrival: Floats  # (way, xyz) world
    travel_time: Floats  # (way,) s
    length: Floats  # (way,) m
    spreading: Floats  # (way,) 1/m
    surface: Ints  # (way,)
    bottom: Ints  # (way,)
    turning: Ints  # (way,)
    caustics: Ints  # (way,)
    boundary: Floats  # (way,)
    phase: Floats  # (way,) rad
    delay_std: Floats  # (way,) s
    approach: Floats  # (way,) speed of the source along the way, over that of sound: pulses are shorter by it

    @staticmethod
    def of(
        paths: Paths, bounced: Reflections, facet: Ints, family: Ints, snap: Emission, speed: float
    ) -> TransmitPaths:  # fmt: skip
        """Of paths to facets (path,) by families (path,) from a snap where sound has this speed (m/s)."""
        loud, turned = directed(snap, paths.departure)
        approach = paths.departure @ snap.velocity / speed if snap.velocity.any() else alike(0.0, len(facet))
        return TransmitPaths(
            facet, family, paths.departure, paths.arrival, paths.travel_time, paths.length, paths.spreading * loud,
            paths.surface, paths.bottom, paths.turning, paths.caustics, bounced.modulus,
            bounced.phase + turned if np.any(turned) else bounced.phase, bounced.delay_std, approach,
        )  # fmt: skip

    def leaving(self, departure: Floats, snap: Emission, speed: float) -> TransmitPaths:
        """The ways, where they leave their snap in other directions (way, xyz), world; speed of sound there, m/s."""
        approach = self.approach + (departure - self.departure) @ snap.velocity / speed
        (loud, turned), (before, first) = (directed(snap, towards) for towards in (departure, self.departure))
        spreading = self.spreading * (loud / np.maximum(before, 1e-300))
        return self.but(departure=departure, spreading=spreading, phase=self.phase + turned - first, approach=approach)

    @staticmethod
    def none(count: int) -> TransmitPaths:
        """No way at all, of paths that come straight from the snap; its spreading is that of the leg."""
        zero, none, nowhere = np.zeros(count), np.zeros(count, int), np.zeros((count, 3))
        return TransmitPaths(
            none, none, nowhere, nowhere, zero, zero, zero + 1.0, none, none, none, none, zero + 1.0, zero, zero, zero
        )

    def merged(self) -> TransmitPaths:
        """The ways, with those of the own image of a snap added to the ways of the snap that they coincide with. Pulses
        that differ stay apart: those that a rough bottom blurs, and those of a snap that moves up or down."""
        image = np.flatnonzero(self.bounces > self.counted)
        if not len(image):
            return self
        before = image - 1
        alike = self.bounces[before] == self.counted[before]  # a source may send nothing up, and then there is none
        for column in (self.facet, self.family, self.travel_time, self.delay_std, self.approach):
            alike &= column[image] == column[before]
        image, before = image[alike], before[alike]
        own = self.spreading * self.boundary * np.exp(1j * self.phase)
        value, silent = own[before] + own[image], SILENCE * (np.abs(own[before]) + np.abs(own[image]))
        boundary, phase = self.boundary.copy(), self.phase.copy()
        boundary[before] = np.abs(value) / self.spreading[before]
        phase[before] = np.angle(value + 0.0)
        gone = np.concatenate([image, before[np.abs(value) <= silent]])
        return self.but(boundary=boundary, phase=phase).select(np.delete(np.arange(len(boundary)), gone))

    @cached_property
    def bounces(self) -> Ints:
        """(way,) reflections from surface and bottom."""
        return np.asarray(self.surface + self.bottom)

    @property
    def counted(self) -> Ints:
        """(way,) reflections that count towards the most of a path: not that of a snap at its own place."""
        return np.asarray((self.family + 1) // 2)


def directed(snap: Emission, departure: Floats) -> tuple[Floats | float, Floats | float]:
    """What a snap sends in directions (path, xyz), world: modulus and phase (rad) over that of its level."""
    if snap.directivity is None:
        return 1.0, 0.0
    factor = snap.directivity(departure)
    return np.abs(factor), np.where(factor < 0.0, np.pi, 0.0)


def path_pairs(out: TransmitPaths, legs: ReceivePaths, facets: int, bounces: int) -> tuple[Ints | slice, Ints]:
    """Every pair of a way out to one of so many facets, each of which has a leg, and a leg from it, with no more than
    so many bounces: which way, or a slice of all of them, and which leg. Legs are sorted by facet, the pairs by way."""
    if len(legs.row) == facets:
        way, leg = picked(out.counted + legs.bounces[out.facet] <= bounces), out.facet
        return way, leg[way]
    begin = np.searchsorted(legs.row, np.arange(facets + 1))
    count = np.diff(begin)[out.facet]
    way = np.repeat(np.arange(len(count)), count)
    leg = begin[out.facet[way]] + np.arange(len(way)) - np.repeat(np.cumsum(count) - count, count)
    within = out.counted[way] + legs.bounces[leg] <= bounces
    return way[within], leg[within]


def assemble(
    legs: ReceivePaths, over: ArrayExpansion, out: TransmitPaths, index: int, time: float, loss: Floats,
    *, kind: Ints | Kind, target: Ints, facet: Ints, scattering: Floats, pulses: PulseResponse,
    amplitude_error: float = 0.0,
) -> Arrivals:  # fmt: skip
    """Arrivals of snap `index` at `time` (s) from both halves of their paths; over: over the aperture; loss: absorption
    of each (dB); pulses: what facets make of the snap; amplitude_error: as of `Arrivals`."""
    length = out.length + legs.length
    sign, phase = as_sign(out.phase + legs.phase + pulses.phase)
    boundary = sign * out.boundary * legs.boundary
    first, second = out.spreading, legs.spreading
    if np.ndim(kind) == 0 and kind == Kind.DIRECT:
        first, second = second, first
    return Arrivals(
        delay=time + (out.travel_time + legs.travel_time),
        direction=legs.direction,
        radius=legs.radius,
        expansion=over,
        amplitude=first * scattering * second * boundary * np.exp(loss * (-np.log(10.0) / 20.0)),
        spreading_out=first,
        spreading_in=second,
        scattering=scattering,
        boundary=boundary,
        absorption=loss,
        length=length,
        kind=alike(np.int8(kind), len(length)) if np.ndim(kind) == 0 else np.asarray(kind, np.int8),
        snap=np.full(len(length), index),
        target=target,
        facet=facet,
        point=legs.point,
        surface=out.surface + legs.surface,
        bottom=out.bottom + legs.bottom,
        turning=out.turning + legs.turning,
        caustics=out.caustics + legs.caustics,
        lit_by=np.asarray((out.surface > 0) + 2 * (out.bottom > 0)),
        arrives_by=np.asarray((legs.surface > 0) + 2 * (legs.bottom > 0)),
        phase=phase,
        delay_std=np.sqrt(out.delay_std**2 + legs.delay_std**2 + pulses.delay_std**2),
        echo_delay_std=pulses.delay_std,
        doppler=np.zeros(len(length)),
        coherent=pulses.coherent,
        corner_delays=pulses.corner_delays,
        coherent_fraction=pulses.coherent_fraction,
        height_delay_std=pulses.height_delay_std,
        occluded=legs.occluded,
        centre=np.nan,
        sound_speed=np.nan,
        amplitude_error=amplitude_error,
    )


def no_arrivals(legs: ReceivePaths) -> Arrivals:
    """No arrivals at all: what a frame without a snap has."""
    none, zero = np.empty(0), np.empty(0, int)
    return assemble(
        legs.select(zero), ArrayExpansion.none(0), TransmitPaths.none(0), 0, 0.0, none,
        kind=Kind.DIRECT, target=zero, facet=zero, scattering=none, pulses=PulseResponse.plain(0),
    )  # fmt: skip


def join(blocks: list[Arrivals], sound_speed: float, centre: float) -> Arrivals:
    """Arrivals of all blocks, sorted by snap, kind and target, at the centre of a band (Hz); terms that some of them
    lack are 0.

    What absorption leaves nothing of is out. The list is emptied.
    """
    blocks.sort(key=lambda block: [*block.snap[:1], *block.kind[:1]])
    order = np.lexsort(
        [np.concatenate([getattr(block, name) for block in blocks]) for name in ("target", "kind", "snap")]
    )
    audible = order[np.concatenate([block.amplitude for block in blocks])[order] != 0.0]
    every = len(audible) == len(order) and bool((np.diff(audible) == 1).all())
    return _stacked(blocks, None if every else audible).but(sound_speed=sound_speed, centre=centre)


def ordered(blocks: list[Arrivals], group: list[Ints]) -> Arrivals:
    """Arrivals of all blocks, sorted by group (path,) of each; the list is emptied."""
    if len(blocks) == 1:
        return blocks.pop()
    return _stacked(blocks, np.argsort(np.concatenate(group), kind="stable"))


def _stacked(blocks: list[Arrivals], rows: Bools | Ints | None) -> Arrivals:
    """These rows of all blocks, one after the other; the list is emptied, so that only one column is there twice."""
    tables = [dict(vars(block)) for block in blocks]
    plain = {name: tables[0][name] for name in ("centre", "sound_speed")}
    blocks.clear()
    columns: dict[str, Any] = {"amplitude_error": max(block["amplitude_error"] for block in tables)}
    for name in [name for name, value in tables[0].items() if isinstance(value, np.ndarray | ArrayExpansion)]:
        join = ArrayExpansion.join if name == "expansion" else stacked
        column = join([block.pop(name) for block in tables])
        columns[name] = column if rows is None else column[rows]
    return Arrivals(**columns, **plain)
