"""Every path of a frame: snap to array, and snap to facet to array."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import NO_TARGET, Floats, Ints, depth
from sonarsynth.geometry import Pose
from sonarsynth.products import Arrivals
from sonarsynth.scattering import ScatteringLaw
from sonarsynth.sonar import Elements
from sonarsynth.tracing.legs import ArrayLegs, Legs, array_legs, hidden, rays_to_centre, usable, with_wavefronts
from sonarsynth.tracing.wavefront import probes
from sonarsynth.world.environment import Environment, Profile
from sonarsynth.world.moment import Moment, Snap

if TYPE_CHECKING:
    from sonarsynth.tracing import Propagation

NEGLIGIBLE = 1e-7
"""A facet whose amplitude is nowhere on the array above this part of the strongest facet's is left out. All that are
left out together stay below their number times this. (Their amplitude at the centre may be so much smaller than at the
edge, 1e-30 in the tail of a lobe, that nothing relative to it has a meaning.)"""


def trace(
    environment: Environment,
    profile: Profile,
    moment: Moment,
    sonar_pose: Pose,
    elements: Elements,
    absorption: float,
    propagation: Propagation,
    law: ScatteringLaw,
) -> Arrivals:
    """The arrivals of a frame, sorted by snap, target, facet and travel time; the direct path of a snap comes first.

    environment, profile: the water; moment: bodies and snaps; sonar_pose, elements: the array; absorption: dB/m at the
    centre of the band; propagation: how sound travels; law: how facets scatter. A facet counts where it is lit by the
    snap and seen by the array centre, with no body in between (all sensors share what the centre sees). Raises
    ValueError for anything outside the water.
    """
    legs = array_legs(environment, profile, moment.bodies, sonar_pose, elements, propagation)
    return arrivals(legs, environment, profile, moment.snaps, absorption, propagation, law)


def arrivals(
    legs: ArrayLegs,
    environment: Environment,
    profile: Profile,
    snaps: tuple[Snap, ...],
    absorption: float,
    propagation: Propagation,
    law: ScatteringLaw,
) -> Arrivals:
    """The arrivals of any snaps from legs that are traced already: as `trace`, without tracing the array side again."""
    parts = [_silence(legs)]
    for index, snap in enumerate(snaps):
        parts.append(_direct(legs, environment, profile, index, snap, absorption, propagation))
        parts.append(_echoes(legs, environment, profile, index, snap, absorption, propagation, law))
    return _join(parts, float(profile.at(depth(legs.sonar_pose.position))))


def _silence(array: ArrayLegs) -> Arrivals:
    """No arrivals at all: what a frame without a snap has."""
    none, zero = np.empty(0), np.empty(0, int)
    return _assemble(
        array.legs.select(zero), 0, 0.0, 0.0, zero, zero, none, (np.empty((0, 0)), 0.0),
        spreading_out=none, spreading_in=none, out_time=none, out_length=none, out_turning=zero,
    )  # fmt: skip


def _direct(
    array: ArrayLegs,
    environment: Environment,
    profile: Profile,
    index: int,
    snap: Snap,
    absorption: float,
    propagation: Propagation,
) -> Arrivals:
    """Snap to array, unless a body stands in between."""
    legs = rays_to_centre(environment, profile, snap.position[None, :], array.sonar_pose, propagation)
    end = np.broadcast_to(array.sonar_pose.position, legs.point.shape)
    legs = legs.select(~hidden(array.bodies, environment, profile, legs.point, end, legs.departure, legs.length))
    legs = with_wavefronts(legs, environment, profile, array.sonar_pose, array.elements, propagation)
    one, zero = np.ones(len(legs.row)), np.zeros(len(legs.row), int)
    none = np.full(len(legs.row), NO_TARGET)
    return _assemble(
        legs, index, snap.time, absorption, none, none, one,
        _variation(array, legs.probe_gain, legs.spreading),
        spreading_out=legs.spreading, spreading_in=one, out_time=0.0 * one, out_length=0.0 * one, out_turning=zero,
    )  # fmt: skip


def _echoes(
    array: ArrayLegs,
    environment: Environment,
    profile: Profile,
    index: int,
    snap: Snap,
    absorption: float,
    propagation: Propagation,
    law: ScatteringLaw,
) -> Arrivals:
    """Snap to facet to array, over every facet of the legs that is lit."""
    row = np.arange(len(array.facet))
    if profile.uniform:  # rays are straight: leave out early what is not lit
        row = np.flatnonzero(np.einsum("ij,ij->i", array.normal, array.legs.point - snap.position) < 0)
    start = np.broadcast_to(snap.position, (len(row), 3))
    out = propagation.connect(profile, environment.depth, start, array.legs.point[row])
    path, row = np.arange(len(out.pair)), row[out.pair]
    incident, normal, area = out.arrival, array.normal[row], array.area[row]
    scattering = np.where(usable(out), law.amplitude(incident, array.legs.departure[row], normal, area), 0.0)
    path = np.flatnonzero(scattering != 0)
    start = np.broadcast_to(snap.position, (len(path), 3))
    blocked = hidden(
        array.bodies, environment, profile, start, array.clear[row[path]], out.departure[path], out.length[path]
    )
    path = path[~blocked]
    over_aperture = law.amplitude(
        incident[path, None, :],
        array.legs.probe_departure[row[path]],
        normal[path, None, :],
        area[path, None],
    )
    strongest = np.maximum(over_aperture.max(axis=1, initial=0.0), scattering[path])
    loud = strongest >= NEGLIGIBLE * strongest.max(initial=0.0)
    path, over_aperture = path[loud], over_aperture[loud]
    row, scattering = row[path], scattering[path]
    legs = array.legs.select(row)
    gain = over_aperture / scattering[:, None] * legs.probe_gain
    gain[(over_aperture == 0).any(axis=1)] = 1.0  # a facet on the limb: all sensors share what the centre sees
    return _assemble(
        legs, index, snap.time, absorption, array.target[row], array.facet[row], _signs(array, law, row) * scattering,
        _variation(array, gain, scattering * legs.spreading * out.spreading[path]),
        spreading_out=out.spreading[path], spreading_in=legs.spreading,
        out_time=out.travel_time[path], out_length=out.length[path], out_turning=out.turning[path],
    )  # fmt: skip


def _signs(array: ArrayLegs, law: ScatteringLaw, row: Ints) -> Floats:
    """Sign (row,) of the echoes of the facets of some legs."""
    every = np.concatenate([np.empty(0), *(law.polarity(body.mesh) for body in array.bodies)])
    first = np.cumsum([0, *(len(body.mesh.faces) for body in array.bodies)])
    return np.asarray(every[first[array.target[row]] + array.facet[row]])


def _variation(array: ArrayLegs, gain: Floats, strength: Floats) -> tuple[Floats, float]:
    """Polynomials (path, term) of gain (path, probe) - 1 over the aperture; no columns where it is 1 everywhere.

    And their largest error at the probes, for paths of that strength (path,), relative to the strongest.
    """
    if (gain == 1.0).all():
        return np.empty((len(gain), 0)), 0.0
    probe = probes(array.elements)
    terms = probe.fit(gain - 1.0)
    loudest = np.nanmax(np.abs(strength)[:, None] * np.abs(gain), initial=0.0)
    return terms, float((np.abs(strength) * probe.misfit(gain - 1.0, terms)).max(initial=0.0) / max(loudest, 1e-300))


def _assemble(
    legs: Legs, index: int, time: float, absorption: float, target: Ints, facet: Ints, scattering: Floats,
    variation: tuple[Floats, float], *, spreading_out: Floats, spreading_in: Floats, out_time: Floats,
    out_length: Floats, out_turning: Ints,
) -> Arrivals:  # fmt: skip
    """Arrivals of one snap from both sides of its paths."""
    length = out_length + legs.length
    loss = absorption * length
    zero = np.zeros(len(length), int)
    return Arrivals(
        delay=time + (out_time + legs.travel_time),
        direction=legs.direction,
        radius=legs.radius,
        delay_terms=legs.delay_terms,
        amplitude_terms=variation[0],
        amplitude=spreading_out * scattering * spreading_in * 10.0 ** (-loss / 20.0),
        spreading_out=spreading_out,
        spreading_in=spreading_in,
        scattering=scattering,
        boundary=np.ones(len(length)),
        absorption=loss,
        length=length,
        snap=zero + index,
        target=target,
        facet=facet,
        point=legs.point,
        surface=zero,
        bottom=zero,
        turning=out_turning + legs.turning,
        caustics=zero,
        phase=np.zeros(len(length)),
        blur=np.zeros(len(length)),
        stretch=np.zeros(len(length)),
        sound_speed=np.nan,
        wavefront_error=float(legs.error.max(initial=0.0)),
        amplitude_error=variation[1],
    )


def _join(parts: list[Arrivals], sound_speed: float) -> Arrivals:
    """Arrivals of all snaps, in order; terms that some of them lack are 0. What absorption leaves nothing of is out."""
    columns = {}
    for name, value in vars(parts[0]).items():
        if isinstance(value, np.ndarray):
            arrays = [getattr(part, name) for part in parts]
            if name.endswith("_terms"):
                width = max(a.shape[1] for a in arrays)
                arrays = [a if a.shape[1] == width else np.zeros((len(a), width)) for a in arrays]
            columns[name] = np.concatenate(arrays)
    heard = columns["amplitude"] != 0.0
    if not heard.all():
        columns = {name: value[heard] for name, value in columns.items()}
    return Arrivals(
        **columns,
        sound_speed=sound_speed,
        wavefront_error=max(part.wavefront_error for part in parts),
        amplitude_error=max(part.amplitude_error for part in parts),
    )
