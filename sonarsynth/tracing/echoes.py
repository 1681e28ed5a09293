"""Echoes of a snap: every way to a facet, every leg from it to the array, and each part of what its law sends back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.columns import alike, picked, rows_of
from sonarsynth.conventions import Bools, Floats, Ints, depth
from sonarsynth.equations.kernels import probe_fits
from sonarsynth.equations.kernels.unit_vectors import to_moved_images
from sonarsynth.geometry import unit
from sonarsynth.geometry.mesh import in_blocks
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.products import ArrayExpansion, Arrivals, Kind
from sonarsynth.propagation.images import family, with_own_images
from sonarsynth.propagation.reflections import reflections
from sonarsynth.scattering import Component
from sonarsynth.scattering.facet_geometry import PulseResponse
from sonarsynth.state import Emission
from sonarsynth.tracing.doppler import (
    MotionTerms,
    apply_doppler,
    bounced_anew,
    meets,
    met_paths,
    mirrored,
    received,
    velocities,
)
from sonarsynth.tracing.echo_batches import PRUNE_MARGIN, EchoBatch, echo_batches, in_band
from sonarsynth.tracing.expansion.amplitude_polynomials import variations
from sonarsynth.tracing.expansion.probe_sensors import probes
from sonarsynth.tracing.expansion.scattering_points import delay_to_scattering_points, shift_to_scattering_points
from sonarsynth.tracing.occlusion.ray_cones import hidden, overlapping
from sonarsynth.tracing.pruning import EchoLevels, loud_of_all, loud_ones
from sonarsynth.tracing.receive_paths import DOUBTFUL, ReceivePaths, may_face_receiver, usable
from sonarsynth.tracing.transmit_paths import TransmitPaths, assemble, no_arrivals, ordered, path_pairs

if TYPE_CHECKING:
    from sonarsynth.tracing.facet_paths import FacetPaths

MAX_PHASE_CHANGE = 1.0
"""rad: a phase of reflection that varies by more over the aperture is not followed."""


@dataclass(frozen=True, eq=False)
class _EchoBlock:
    """Echoes of a snap from some facets, group by group."""

    array: FacetPaths  # of these facets
    groups: list[EchoBatch]
    out: TransmitPaths  # (pair,)
    leg: Ints  # (pair,)
    factor: Floats  # (pair,) what the ways do to amplitudes
    law: Floats  # (echo, probe) amplitudes of the law at the probes
    pulses: PulseResponse  # (echo,)
    carried: MotionTerms | None  # (pair,); None: nothing moves
    legs: ReceivePaths | None = None  # (pair,) with the hydrophones that do not hear it; None: not looked at

    def heard(self, loud: Bools) -> _EchoBlock:
        """The echoes picked by a mask that a hydrophone hears, with what hides the others."""
        legs, in_sight = self.array.settled(self.leg[_columns(self.groups, "row")[0][loud]])
        heard = loud.copy()
        heard[loud] = in_sight
        return replace(self.select(heard), legs=legs)

    def select(self, loud: Bools) -> _EchoBlock:
        """The echoes picked by a mask, each with a pair of its own."""
        ends = np.cumsum([len(g.row) for g in self.groups])[:-1]
        groups = [g.select(np.flatnonzero(keep)) for g, keep in zip(self.groups, np.split(loud, ends), strict=True)]
        (row,), last = _columns(groups, "row"), np.cumsum([len(g.row) for g in groups]).tolist()
        groups = [g.but(row=np.arange(end - len(g.row), end)) for g, end in zip(groups, last, strict=True)]
        out, leg, factor = self.out.select(row), self.leg[row], self.factor[row]
        carried, kept = None if self.carried is None else self.carried.select(row), np.flatnonzero(loud)
        law, pulses = rows_of(self.law, kept), self.pulses.select(kept)
        return _EchoBlock(self.array, groups, out, leg, factor, law, pulses, carried)

    @cached_property
    def strength(self) -> Floats:
        """(echo,) amplitude with the ways."""
        row, amplitude = _columns(self.groups, "row", "amplitude")
        return np.asarray(amplitude * self.factor[row])

    @property
    def gains(self) -> tuple[Floats, Floats, float]:
        """What `probe_fits.gains` makes of the law and of the legs at the probes."""
        row, amplitude, tapered = _columns(self.groups, "row", "amplitude", "tapered")
        return probe_fits.gains(self.law, amplitude, self.array.fronts.gain(self.leg[row]), tapered, self.strength)

    def levels(self) -> EchoLevels:
        """What decides which echoes are kept."""
        row, amplitude = _columns(self.groups, "row", "amplitude")
        at_probes = np.abs(self.law.T, order="C").max(axis=0, initial=0.0)
        strongest = np.maximum(at_probes, np.abs(amplitude)) * self.factor[row]
        owner = self.array.facets.owner[self.out.facet[row]]
        strength = strongest * in_band(self.pulses, self.array.context.receiver.band)
        heard = self.array.legs.open[self.leg[row]] < DOUBTFUL
        return EchoLevels(strength, self.pulses.coherent, owner, heard, self.group)

    @property
    def group(self) -> Ints:
        """(echo,) which group it is in."""
        return np.repeat(np.arange(len(self.groups)), [len(g.row) for g in self.groups])


def echoes(array: FacetPaths, index: int, components: tuple[tuple[Component, ...], ...], kind: Kind) -> Arrivals:
    """Emission `index` to facet to array, over every facet of the legs that is lit; components: of the law of each
    owner.

    Facets are taken in blocks, so that little is held at a time; the echoes are those of one block, in its order.
    """
    if not any(components):
        return no_arrivals(array.legs)
    snap, receiver, profile = array.context.snaps[index], array.context.receiver, array.context.medium.profile
    blocks = _loudest(array, snap, components)
    terms, error = variations(receiver, (block.gains for block in blocks))
    strongest = max(float(np.abs(block.strength).max(initial=0.0)) for block in blocks)
    group, arrivals = [block.group for block in blocks], []
    blocks.reverse()
    for variation in terms:
        block = blocks.pop()
        over = _with_reflection_phases(block, strongest)
        (spot,) = _columns(block.groups, "spot")
        if spot.any() and not block.array.bending.profile.uniform:
            over = delay_to_scattering_points(over, block.array, block.leg, spot)
        array, out, legs, meeting = block.array, block.out, block.legs, block.array.meeting
        assert legs is not None
        if meeting is not None and block.carried is not None:
            legs = received(legs, block.carried, meeting, array.context.medium, receiver.centre)
        kinds, target, facet = array.met(out.facet, kind)
        amplitude, sign = _columns(block.groups, "amplitude", "sign")
        scattered, medium, met = sign * amplitude, array.context.medium, depth(legs.point)
        loss = medium.absorbed(legs.length, met, depth(receiver.pose.position), legs.departure[:, 2], legs.bounces)
        loss += medium.absorbed(out.length, met, depth(snap.position), -out.arrival[:, 2], out.bounces)
        echo = assemble(
            legs, over.but(amplitude=variation), out, index, snap.time, loss, kind=kinds, target=target,
            facet=facet, scattering=scattered, pulses=block.pulses, amplitude_error=error,
        )  # fmt: skip
        if meeting is not None and block.carried is not None:
            echo = apply_doppler(echo, legs, out, block.carried, meeting, profile, receiver.elements)
        if spot.any() and array.bending.profile.uniform:
            echo = shift_to_scattering_points(echo, legs, spot, receiver.pose)
        arrivals.append(echo.but(delay=echo.delay + block.pulses.late))
    return ordered(arrivals, group)


def _loudest(array: FacetPaths, snap: Emission, components: tuple[tuple[Component, ...], ...]) -> list[_EchoBlock]:
    """Echoes from each block of facets that are not too faint.

    What is much fainter than will do, by the blocks so far, is not held; should it be wanted after all, its block is
    looked at again.
    """
    blocks = in_blocks(len(array.facets.facet))
    if len(blocks) == 1:
        block = _all_echoes(array, snap, components)
        return [block.heard(loud_ones(block.levels(), array.context.tolerances.negligible))]
    loud: list[_EchoBlock] = []
    levels: list[EchoLevels] = []
    masks: list[Bools] = []
    for rows in blocks:
        block = _all_echoes(array.part(rows), snap, components)
        levels.append(block.levels())
        masks.append(loud_of_all(levels, PRUNE_MARGIN * array.context.tolerances.negligible)[-1])
        loud.append(block.select(masks[-1]))
    for n, wanted in enumerate(loud_of_all(levels, array.context.tolerances.negligible)):
        if (wanted & ~masks[n]).any():
            loud[n] = _all_echoes(array.part(blocks[n]), snap, components).heard(wanted)
        else:
            loud[n] = loud[n].heard(wanted[masks[n]])
    return loud


def _all_echoes(array: FacetPaths, snap: Emission, components: tuple[tuple[Component, ...], ...]) -> _EchoBlock:
    """All echoes of a snap from the facets of the legs."""
    out = _ways_to_facets(array, snap)
    way, leg = path_pairs(out, array.legs, len(array.facets.facet), array.propagation.bounces)
    if array.ways is not None:
        wanted = np.zeros((2 * array.propagation.bounces + 1,) * 2, bool)
        wanted[tuple(np.transpose(array.ways))] = True
        some = np.flatnonzero(wanted[out.family[way], array.legs.family[leg]])
        way, leg = np.arange(len(out.facet))[way][some], leg[some]
    out, carried = (out, None) if array.meeting is None else _carried(array, snap, out, way, leg)
    out = out.select(way)
    factor = array.legs.spreading[leg] * array.legs.boundary[leg] * out.spreading * out.boundary
    groups = echo_batches(array, out, leg, components, carried, factor)
    law = _joined([g.over(_towards_probes(array, leg, carried, g)) for g in groups])
    pulses = PulseResponse.join([g.pulses(array.context.receiver.centre) for g in groups])
    return _EchoBlock(array, groups, out, leg, factor, law, pulses, carried)


def _carried(
    array: FacetPaths, snap: Emission, out: TransmitPaths, way: Ints | slice, leg: Ints
) -> tuple[TransmitPaths, MotionTerms]:
    """Ways when and where sound meets what moves, and the rest of the motion of pairs (pair,) of a way and a leg."""
    meeting, facets = array.meeting, array.facets
    assert meeting is not None
    owner, point = facets.owner[out.facet], rows_of(facets.point, out.facet)
    velocity, spin = velocities(array.context.scattering, owner, point)
    met = meeting.met[owner]
    medium, z = array.context.medium, depth(point)
    met_out, late, apart = meets(out, met, velocity, snap.time, medium.profile.at(z))
    met_out = bounced_anew(met_out, z, out.arrival, met_out.arrival, medium, array.context.receiver.centre)
    if snap.directivity is not None or snap.velocity.any():
        departure = unit(out.departure + mirrored(met_out.arrival - out.arrival, out.bounces))
        met_out = met_out.leaving(departure, snap, float(medium.profile.at(depth(snap.position))))
    return met_out, met_paths(array.legs, leg, MotionTerms(met, late, velocity, spin, apart).select(way), meeting)


def _towards_probes(array: FacetPaths, leg: Ints, carried: MotionTerms | None, group: EchoBatch) -> Floats:
    """Where the probes are seen from the facets of a group (echo, probe, xyz), in the frame of its body; leg, carried:
    of all pairs (pair,)."""
    body, fronts, legs = group.surface.pose, array.fronts, array.legs
    motion = MotionTerms.none(len(leg)) if carried is None else carried
    if fronts.probe_departure is not None:
        rows = leg[group.row]
        return motion.select(group.row).departure(legs.length[rows], fronts.departure(rows), body)
    offset = array.context.receiver.pose.turn_to_world(fronts.place.probe.position)
    ray = legs.length, legs.departure, legs.bounces, offset, group.row, leg
    return np.asarray(to_moved_images(*ray, motion.apart, motion.late, motion.spin, body.rotation))


def _columns(groups: list[EchoBatch], *names: str) -> list[np.ndarray]:
    """Columns (echo,) of all groups, in order."""
    return [_joined([getattr(g, name) for g in groups]) for name in names]


def _joined(blocks: list[np.ndarray]) -> np.ndarray:
    """Rows of all blocks, in order; of one alone, that itself."""
    return blocks[0] if len(blocks) == 1 else np.concatenate(blocks)


def _ways_to_facets(array: FacetPaths, snap: Emission) -> TransmitPaths:
    """Ways from a snap to the lit side of facets that no body hides; of facets in one place, the first body's."""
    medium, bodies, facets = array.context.medium, array.context.bodies, array.facets
    bounces, row = array.propagation.bounces, np.arange(len(facets.facet))
    row = row if array.lit else may_face_receiver(facets, snap.position, bounces, medium)
    start = alike(snap.position, len(row))
    paths = array.propagation.checked_paths(medium.profile, medium.depth, start, rows_of(facets.point, row))
    lit = array.lit or facets.lit(row[paths.pair], paths.arrival)
    paths = paths.select(picked(usable(paths) & lit))
    families = family(paths.surface, paths.bottom, paths.arrival[:, 2] < 0.0)
    if array.ways is not None:
        wanted = np.flatnonzero(np.isin(families, [way for way, _ in array.ways]))
        paths, families = paths.select(wanted), families[wanted]
    down = float(depth(snap.position))
    if bounces:
        paths, along = with_own_images(paths, down, medium.depth)
        families = families[along]
    bounced = reflections(medium.environment, medium.profile, paths, array.context.receiver.centre)
    out = TransmitPaths.of(paths, bounced, row[paths.pair], families, snap, float(medium.profile.at(down)))
    out = out.select(picked(out.spreading != 0.0)).merged()
    if not array.lit:
        owner, facet = facets.owner[out.facet], facets.facet[out.facet]
        out = out.select(picked(~_hides(array, bodies, snap, out, rows_of(facets.clear, out.facet), (owner, facet))))
    for number, before in overlapping(bodies):
        owned = np.flatnonzero(facets.owner[out.facet] == number)
        of = out.facet[owned]
        again = _hides(array, before, snap, out.select(owned), 2.0 * facets.point[of] - facets.clear[of])  # from under
        out = out.select(np.delete(np.arange(len(out.facet)), owned[again]))
    return out


def _hides(
    array: FacetPaths, bodies: tuple[PlacedTarget, ...], snap: Emission, out: TransmitPaths, start: Floats,
    facets: tuple[Ints | None, Ints | None] = (None, None),
) -> Bools:  # fmt: skip
    """Whether any of some bodies stands in ways (way,) from a snap to points near facets, start (way, xyz); facets: as
    of `hidden`."""
    end = alike(snap.position, len(start))  # backwards: bodies are where a ray begins
    ways = start, end, -out.arrival, out.length
    return hidden(bodies, array.bending, *ways, bounces=out.bounces, turning=out.turning, facets=facets)


def _with_reflection_phases(block: _EchoBlock, strongest: float) -> ArrayExpansion:
    """Wavefronts (path,) of echoes, with the phases of reflections from facets to each probe; strongest: of all.

    They vary over the aperture where part of the sound enters the body; what polynomials miss counts as far as the echo
    is as strong as the strongest. Where the coefficient passes near 0 its phase leaps: there all sensors have that of
    the centre.
    """
    (row,), array, leg = _columns(block.groups, "row"), block.array, block.leg
    over = array.fronts.expansion[leg[row]]
    if not any(g.part.turns for g in block.groups):
        return over
    shift = _joined([g.turned(_towards_probes(array, leg, block.carried, g)) for g in block.groups])
    leaps = np.abs(shift).max(axis=1, initial=0.0) > MAX_PHASE_CHANGE
    if not shift.any():
        return over
    probe = probes(array.context.receiver.elements)
    terms, missed = probe.expand(np.where(leaps[:, None], 0.0, shift))
    share = np.abs(block.strength) / max(strongest, 1e-300)
    error = over.error + share * missed / (2.0 * np.pi * array.context.receiver.band[1])
    return over.but(phase=over.phase + terms if over.phase.shape[1] else terms, error=error)
