"""What hydrophones hear of a frame, from its description alone: path by path, frequency by frequency, in float64.

It shares nothing with tracing, synthesis and their equations. What it takes from the rest is what is described: meshes,
motions, snaps, the profile of sound speed, the array and its filter, and signs that are drawn. Everything of a path is
taken where the sound meets things (`sound_paths`), for every hydrophone by itself: delays, Doppler, directions,
spreading, who stands in the way. An echo of a facet is

    law(directions) A_out A_in V exp(-losses) at time t_2, through the face of the hydrophone and the filter,

with the amplitudes A of the rays (`layered_rays`), the coefficient V of all reflections, and the facet's own centroid,
normal and area. Choices of the model that are the same: a facet is lit and seen where its centroid, off the body by a
millionth of the body's size, is clear of bodies, and scatters as if at rest; the reflection of a snap that lies on the
bottom at its own place does not count as one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.fft import next_fast_len

from sonarsynth.conventions import Floats
from sonarsynth.environment.sea import Profile
from sonarsynth.receiver.hydrophones import elements
from sonarsynth.recipe.scene import Frame, Scene
from sonarsynth.state import Emission
from sonarsynth.validation.references.frames.facet_laws import amplitudes, known, signs
from sonarsynth.validation.references.frames.line_of_sight import Surface
from sonarsynth.validation.references.frames.moving_points import Mover
from sonarsynth.validation.references.frames.path_sum import Contributions, stretches, transfer
from sonarsynth.validation.references.frames.snap_spectrum import absorption, duration, filter_response, spectrum
from sonarsynth.validation.references.frames.sound_paths import Solid, arrival_times, depths, hidden, met
from sonarsynth.validation.references.rays.boundaries_met import reflected
from sonarsynth.validation.references.rays.layered_rays import Family, Rays, families, source_families
from sonarsynth.validation.references.rays.layers_crossed import Water
from sonarsynth.validation.references.rays.rays_missed import knows_every_ray

OFF = 1e-6
"""Of a body's size: how far off a facet a line of sight begins."""
SLANT = 0.3
"""Bent rays leave a facet by less than this (rad) beside straight ones: others are not looked for."""
STOPPED = 2e-5
"""What the filter leaves of the snap may be so little of the largest, and be left out."""


@dataclass(frozen=True, eq=False)
class Body:
    """A target: its facets in its own frame, and how it moves."""

    solid: Solid
    centre: Floats  # (facet, xyz) m
    clear: Floats  # (facet, xyz) m
    normal: Floats  # (facet, xyz)
    area: Floats  # (facet,) m2
    sign: Floats  # (facet,)
    number: int


@dataclass(frozen=True, eq=False)
class FramePressure:
    """A frame to be heard."""

    scene: Scene
    frame: Frame
    profile: Profile

    @property
    def unknown(self) -> str:
        """Why this frame cannot be computed here; empty where it can."""
        wrong = [type(law).__name__ for law in self.scene.laws if not known(law)]
        if wrong:
            return f"{wrong[0]} is not among the laws of the independent computation"
        if not knows_every_ray(self.water, *self._ends(), self.bounces):
            return "rays of one family past caustics, or that turn twice, are not in the independent computation"
        return ""

    def pressure(self, sensors: Sequence[int], start: float, samples: int) -> tuple[Floats, Floats]:
        """Echoes, and what comes without a target, (sensor, sample) in Pa; start: s of the first sample, on the clock
        of the frame."""
        out = np.zeros((2, len(sensors), samples))
        for snap in self.frame.moment.snaps:
            lit = [facets for body in self.bodies for facets in self._lit(snap, body) if snap.illuminates]
            for n, sensor in enumerate(sensors):
                if elements(self.scene.sonar.array).gain[sensor]:
                    position = elements(self.scene.sonar.array).position[sensor]
                    out[0, n] += self._signal(snap, self._echoes(lit, position), start, samples)
                    out[1, n] += self._signal(snap, self._direct(snap, position), start, samples)
        return out[0], out[1]

    @cached_property
    def water(self) -> Water:
        """What rays go through."""
        return Water(self.profile.depth, self.profile.speed, self.scene.world.environment.depth)

    @cached_property
    def sonar(self) -> Mover:
        """The array."""
        return Mover(self.scene.trajectory.sonar, self.frame.time, self.scene.physics.doppler)

    @cached_property
    def bodies(self) -> tuple[Body, ...]:
        """The targets."""
        bodies = []
        for number, target in enumerate(self.scene.world.targets):
            mesh = self.scene.mesh_of(number)
            corners = mesh.vertices[mesh.faces]
            cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            twice = np.linalg.norm(cross, axis=1)
            centre, normal = corners.mean(axis=1), cross / twice[:, None]
            size = float(np.linalg.norm(mesh.vertices, axis=1).max())
            solid = Solid(Mover(target.motion, self.frame.time, self.scene.physics.doppler), Surface.of(corners))
            sign = signs(self.scene.laws[number], mesh)
            bodies.append(Body(solid, centre, centre + OFF * size * normal, normal, 0.5 * twice, sign, number))
        return tuple(bodies)

    @property
    def solids(self) -> list[Solid]:
        """All that may stand in the way."""
        return [body.solid for body in self.bodies]

    @property
    def bounces(self) -> int:
        """Most reflections of a path."""
        return self.scene.physics.tracing.bounces

    def _ends(self) -> tuple[Floats, Floats]:
        """Points (ray, xyz) that rays join: snaps, outermost facets of bodies and their middles, and hydrophones."""
        array = elements(self.scene.sonar.array).position
        heard = np.vstack([np.zeros(3), array[array.argmin(axis=0)], array[array.argmax(axis=0)]])
        points = [self.sonar.points(heard, np.zeros(len(heard)))]
        for body in self.bodies:
            outermost = np.unique([body.centre.argmin(axis=0), body.centre.argmax(axis=0)])
            chosen = np.vstack([body.centre.mean(axis=0), body.centre[outermost]])
            points.append(body.solid.mover.points(chosen, np.zeros(len(chosen))))
        ends = np.vstack(points)
        starts = np.array([snap.position for snap in self.frame.moment.snaps] + [ends[0]])
        rows = [(n, m) for n in range(len(starts)) for m in range(len(heard) * (n == len(starts) - 1), len(ends))]
        return starts[[n for n, _ in rows]], ends[[m for _, m in rows]]

    def _lit(self, snap: Emission, body: Body) -> list[_LitFacets]:
        """The facets of a body that a snap lights, by each family."""
        groups = []
        for family, counted in source_families(self.bounces, -snap.position[2], self.water.bottom, back=True):
            rows = self._towards(
                body, np.arange(len(body.centre)), np.full(len(body.centre), snap.time), snap.position, family
            )
            if not len(rows):
                continue
            time, back = met(self.water, snap.position, snap.time, body.solid.mover, body.centre[rows], family)
            normal = body.solid.mover.turned(body.normal[rows], time)
            lit = np.flatnonzero(np.einsum("nx,nx->n", normal, back.departure) > 0.0)
            if not len(lit):
                continue
            rows, time, back, normal = rows[lit], time[lit], back.select(lit), normal[lit]
            clear = body.solid.mover.points(body.clear[rows], time)
            end = np.broadcast_to(snap.position, clear.shape)
            sent = np.full(len(time), snap.time)
            free = np.flatnonzero(~hidden(self.solids, self.water, clear, end, back, time, sent))
            of = rows[free], time[free], back.select(free), normal[free]
            groups.append(_LitFacets(body, *of, family, counted, *self._sent(snap, -back.arrival[free])))
        return groups

    def _sent(self, snap: Emission, departure: Floats) -> tuple[Floats, Floats]:
        """What a snap sends in directions (ray, xyz), world, over what it would if alike in all, and how many times as
        long its pulse is there, by its motion."""
        loud = np.ones(len(departure)) if snap.directivity is None else snap.directivity(departure)
        velocity = snap.velocity if self.scene.physics.doppler else 0.0 * snap.velocity
        return loud, 1.0 - departure @ velocity / float(self.water.at(-snap.position[2:])[0])

    def _towards(self, body: Body, rows: np.ndarray, time: Floats, position: Floats, family: Family) -> np.ndarray:
        """Facets whose outer side may face the image of a position (xyz)."""
        point = body.solid.mover.points(body.centre[rows], time)
        normal = body.solid.mover.turned(body.normal[rows], time)
        image = family.image(np.array([-position[2]]), self.water.bottom)[0]
        away = np.array([position[0], position[1], -image]) - point
        margin = SLANT if np.ptp(self.water.speed) > 0.0 else 0.05
        return np.asarray(rows[np.einsum("nx,nx->n", normal, away) > -margin * np.linalg.norm(away, axis=1)])

    def _echoes(self, lit: list[_LitFacets], position: Floats) -> list[Contributions]:
        """What one hydrophone hears of the facets."""
        contributions = []
        for facets in lit:
            for family in families(self.bounces - facets.counted):
                contributions += self._echo(facets, position, family)
        return contributions

    def _echo(self, lit: _LitFacets, position: Floats, family: Family) -> list[Contributions]:
        body, mover = lit.body, lit.body.solid.mover
        centre = self.sonar.points(position[None], np.zeros(1))[0]
        facing = np.isin(lit.row, self._towards(body, lit.row, lit.time, centre, family))
        if not facing.any():
            return []
        facets = lit.select(np.flatnonzero(facing))
        point = mover.points(body.centre[facets.row], facets.time)
        late, ray = arrival_times(self.water, point, facets.time, self.sonar, position, family)
        visible = np.flatnonzero(np.einsum("nx,nx->n", facets.normal, ray.departure) > 0.0)
        if not len(visible):
            return []
        facets, ray, late = facets.select(visible), ray.select(visible), late[visible]
        end = self.sonar.points(np.broadcast_to(position, (len(visible), 3)), late)
        clear = mover.points(body.clear[facets.row], facets.time)
        free = np.flatnonzero(~hidden(self.solids, self.water, clear, end, ray, facets.time, late))
        facets, ray, late = facets.select(free), ray.select(free), late[free]
        law = self.scene.laws[body.number]
        size = amplitudes(law, -facets.back.departure, ray.departure, facets.normal, body.area[facets.row])
        velocity = mover.velocity(body.centre[facets.row], facets.time)
        c = self.water.at(-mover.points(body.centre[facets.row], facets.time)[:, 2])
        out, away = (np.einsum("nx,nx->n", velocity, x) / c for x in (-facets.back.departure, ray.departure))
        size = size * body.sign[facets.row] * facets.loud * facets.back.spreading * ray.spreading
        longer = facets.longer * (1.0 - away) / (1.0 - out)
        return [self._arriving(position, late, size, longer, (facets.back, facets.family), (ray, family))]

    def _direct(self, snap: Emission, position: Floats) -> list[Contributions]:
        """What one hydrophone hears without a target."""
        contributions, sent = [], np.array([snap.time])
        for family, _ in source_families(self.bounces, -snap.position[2], self.water.bottom):
            late, ray = arrival_times(self.water, snap.position[None], sent, self.sonar, position, family)
            end = self.sonar.points(position[None], late)
            if not hidden(self.solids, self.water, snap.position[None], end, ray, sent, late)[0]:
                loud, longer = self._sent(snap, ray.departure)
                contributions.append(self._arriving(position, late, loud * ray.spreading, longer, (ray, family)))
        return contributions

    def _arriving(
        self, position: Floats, late: Floats, size: Floats, longer: Floats, *ways: tuple[Rays, Family]
    ) -> Contributions:
        """Rows of paths; longer (path,): of a pulse that leaves the last facet."""
        environment, centre = self.scene.world.environment, self.scene.sonar.band.centre
        bounced = [reflected(environment, self.water, family, ray.cosine, centre) for ray, family in ways]
        last, own = ways[-1][0], np.broadcast_to(position, (len(late), 3))
        end = self.sonar.points(own, late)
        slow = last.arrival / self.water.at(-end[:, 2])[:, None]
        along = np.einsum("nx,nx->n", self.sonar.velocity(own, late), slow)
        face = np.einsum("nji,nj->ni", self.sonar.places(late)[1], slow)[:, 1:]
        return Contributions(
            time=late,
            size=np.prod([v for v, _ in bounced], axis=0) * size,
            longer=longer / (1.0 - along) - 1.0,
            length=sum(depths(self.water, ray) for ray, _ in ways),  # type: ignore[arg-type]
            delay_std=np.asarray(sum(b for _, b in bounced)),
            face=elements(self.scene.sonar.array).face * face,
        )

    def _signal(self, snap: Emission, contributions: list[Contributions], start: float, samples: int) -> Floats:
        """Pressure (sample,) of what arrives."""
        rate, chosen = self.scene.sonar.sampling_frequency, self.scene.sonar.antialias
        pad = int(np.ceil(1.2 * duration(snap, chosen) * rate))
        signal = np.zeros(samples)
        if not contributions:
            return signal
        every = Contributions.join(contributions)
        sample = (every.time - start) * rate
        every = every.select(np.flatnonzero((sample > -pad) & (sample < samples + pad)))
        if not len(every.time):
            return signal
        first, last = (int(np.floor((f(every.time) - start) * rate)) for f in (np.min, np.max))
        first, length = first - pad, next_fast_len(last - first + 2 * pad + 1, real=True)
        step = rate / length
        frequency = np.arange(length // 2 + 1) * step
        passed = filter_response(chosen, frequency)
        left = np.abs(passed * spectrum(snap, step, len(frequency)))
        low, high = np.flatnonzero(left > STOPPED * left.max())[[0, -1]]
        node, weight = stretches(every.longer)
        total = transfer(every, weight, start + first / rate, step, int(low), self._loss(frequency[low : high + 1]))
        out = np.zeros(len(frequency), complex)
        for stretch, of_node in zip(node, total, strict=True):
            out[low : high + 1] += of_node * spectrum(snap, step, len(frequency), float(stretch))[low : high + 1]
        within = slice(max(first, 0), min(first + length, samples))
        signal[within] = np.fft.irfft(out * passed, length)[within.start - first : within.stop - first] * rate
        return signal

    def _loss(self, frequency: Floats) -> Floats:
        """Absorption (bin, 3) in dB/m, and its first two powers of depth: a parabola through three depths."""
        depth = np.array([0.0, 0.5, 1.0]) * self.water.bottom
        loss = absorption(self.scene.world.environment.absorption, frequency, depth)
        return np.asarray(np.linalg.solve(np.vander(depth, increasing=True), loss), float).T


@dataclass(frozen=True, eq=False)
class _LitFacets:
    """Facets of a body that a snap lights by one family of rays."""

    body: Body
    row: np.ndarray  # (facet,) which
    time: Floats  # (facet,) s: when the sound meets them
    back: Rays  # (facet,) to the snap
    normal: Floats  # (facet, xyz) world, then
    family: Family  # of the rays back
    counted: int  # reflections, but for one at the very place of a snap that lies on the bottom
    loud: Floats  # (facet,) what the snap sends that way, over its level
    longer: Floats  # (facet,) its pulse lasts so many times as long, by its motion

    def select(self, rows: np.ndarray) -> _LitFacets:
        """Some of them."""
        of = self.row[rows], self.time[rows], self.back.select(rows), self.normal[rows]
        return _LitFacets(self.body, *of, self.family, self.counted, self.loud[rows], self.longer[rows])
