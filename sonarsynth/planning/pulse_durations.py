"""How long pulses are, as the sonar hears them: what windows must hold of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from sonarsynth.conventions import SLOWEST, Floats
from sonarsynth.environment.boundary_numbers import rms_height
from sonarsynth.equations.arrays.bistatic_range import MIN_ONE_PLUS_COS
from sonarsynth.geometry import unit
from sonarsynth.geometry.mesh import farthest_corner
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.planning.measured.sampled_frames import SampledScene
from sonarsynth.planning.plans import PulseDurations
from sonarsynth.ranging.range_profiles import StretchedEcho, stretched_echo
from sonarsynth.receiver import Sonar, elements
from sonarsynth.recipe.scene import Frame, Scene
from sonarsynth.signals import pulse_support
from sonarsynth.signals.filtered_pulse import PULSE_FEET, at_longest, envelope_delay, silencing_blur
from sonarsynth.signals.isolated_paths import sent_energy, whole_spectrum
from sonarsynth.sources.snap_pulses import Waveform, waveform
from sonarsynth.state import Emission

SUPPORT = 1e-7
"""The sample window holds every pulse down to this part of its peak; so long after the direct one begin the echoes."""
TAIL = 1e-3
"""s after the direct pulse in its plain shape: echoes are heard from then on, though a turned one has a longer tail."""
ECHO_SUPPORT = 1e-4
"""The echo window holds every echo down to this part of its peak: its feet, under -80 dB, are cut."""
DIRECT = 0.1
"""What ranging takes out of echoes is the direct pulse where it is over this part of its peak."""
AT_ONCE = 10e-6
"""s: a pulse that is loudest so soon before or after its time 0 is loudest then."""
QUIET = 1e-6
"""Of the energy of the loudest emission of a frame in the band that one has which is ranged by."""
FOOT = 1e-2
"""Where the direct pulse is in the way, feet of echoes under this part of their peak may be cut."""


class Stretch(NamedTuple):
    """What motion does to the pulse of an echo."""

    part: float = 0.0  # by which it lasts longer than the direct one
    by_path: float = 0.0  # m of range a m of its path: 0 where it has none, next to the line from source to array
    waveform: Waveform | None = None
    longer: float = 0.0  # s


def supports_of(looks: Sequence[SampledScene]) -> PulseDurations:
    """How long pulses are, over all scenes."""
    rows = []
    for look in looks:
        scene, profile = look.scene, look.profile
        array = elements(scene.sonar.array)
        # of a wave, from the centre to the far corner of the face at the rim
        across = (array.aperture + np.sqrt(0.5) * array.face) / profile.speed.min()
        lossy = any(law.turns_phase for law in scene.laws)
        turned = lossy or scene.physics.tracing.bounces > 0 or not profile.uniform  # also caustics turn the phase
        before, after = _support(scene, SUPPORT, turned=turned) + across
        plain = _support(scene, SUPPORT, turned=False)[1]
        early = min((lateness(w, scene.sonar) for w in extreme_waveforms(scene)), default=0.0)
        clear = min(after, plain + across + TAIL) - min(early, 0.0)  # a turned pulse may never end, and hide all echoes
        echo, foot = (_support(scene, threshold, turned=turned) + across for threshold in (ECHO_SUPPORT, FOOT))
        rows.append((before, after, *echo, clear, foot.max(), _direct(scene)))
    return replace(PulseDurations(*(float(n) for n in np.max(rows, axis=0))), late=_late(looks))


def _late(looks: Sequence[SampledScene]) -> float:
    """`PulseDurations.late`, of the pulse that motion makes longest or shortest: in proportion to that."""
    rows = [(row, look.scene.sonar) for look in looks for row in stretches(look)]
    worst, sonar = max(rows, key=lambda pair: abs(pair[0].longer), default=(Stretch(), looks[0].scene.sonar))
    part = np.array([row.part for row, _ in rows if row.waveform == worst.waveform])
    late = abs(ranged_echo(worst.part, worst.waveform, sonar).late)
    return late * float(np.sqrt(np.mean(part**2))) / abs(worst.part) if late else 0.0


def stretches(look: SampledScene) -> list[Stretch]:
    """Of each body, emission and frame."""
    if not look.scene.physics.doppler:
        return []
    sonar = look.scene.sonar
    rows = [(f, b, s) for f in look.frames for s in _loud(f.moment.snaps, sonar) for b in f.moment.bodies]
    return [_stretch(*row, sonar) for row in rows]


def _loud(snaps: tuple[Emission, ...], sonar: Sonar) -> list[Emission]:
    """Emissions without those of which the band has next to nothing beside others: echoes are not ranged by them."""
    energy = sent_energy(snaps, sonar)
    return [snap for snap, own in zip(snaps, energy, strict=True) if own >= QUIET * energy.max()]


def _stretch(frame: Frame, body: PlacedTarget, snap: Emission, sonar: Sonar) -> Stretch:
    array, velocity = frame.sonar_pose.position, frame.sonar_velocity
    out, on, past = (
        unit(b - a)
        for a, b in ((snap.position, body.pose.position), (body.pose.position, array), (snap.position, array))
    )
    longer = out @ (body.velocity - snap.velocity) + on @ (velocity - body.velocity) - past @ (velocity - snap.velocity)
    both = 1.0 - float(out @ on)
    part, shape = float(longer) / sonar.assumed_sound_speed, snap.waveform
    lasts = shape.width * _lasts(shape._replace(width=1.0), sonar)
    return Stretch(part, 1.0 / both if both > MIN_ONE_PLUS_COS else 0.0, shape, part * lasts)


@lru_cache(maxsize=64)
def ranged_echo(stretch: float, shape: Waveform | None, sonar: Sonar) -> StretchedEcho:
    """What ranging makes of an echo whose pulse lasts 1 + stretch times as long."""
    if shape is None or stretch == 0.0:
        return StretchedEcho(0.0, 1.0)
    (f, wave), (_, longer) = (whole_spectrum(shape, sonar, doppler) for doppler in (0.0, stretch))
    band = slice(*np.searchsorted(f, [sonar.band.low, sonar.band.high]))
    if len(f[band]) < 2:  # too narrow for anything to be located, or ranged
        return StretchedEcho(0.0, 1.0)
    return stretched_echo(f[band], wave[band], longer[band], sonar.band)


def _direct(scene: Scene) -> float:
    """Longest time (s) before or after the peak of its envelope that any filtered snap exceeds `DIRECT` of its peak."""
    return max((_lasts(shape, scene.sonar) for shape in extreme_waveforms(scene)), default=0.0)


@lru_cache(maxsize=64)
def _lasts(shape: Waveform, sonar: Sonar) -> float:
    (before, after), late = pulse_support(shape, sonar.antialias, DIRECT), envelope_delay(shape, sonar)
    return max(before + late, after - late)


@lru_cache(maxsize=64)
def lateness(shape: Waveform, sonar: Sonar) -> float:
    """When (s) after its time 0 a pulse is loudest, for the sonar its arrival; 0 where windows have room for it."""
    late = envelope_delay(shape, sonar)
    return late if abs(late) > AT_ONCE else 0.0


def _support(scene: Scene, tolerance: float, *, turned: bool) -> Floats:
    """Longest time (s) before and after its collapse that any filtered snap exceeds `tolerance` of its peak, and the
    echo of any facet."""
    chosen, waveforms = scene.sonar.antialias, extreme_waveforms(scene)
    supports = [(0.0, 0.0), *(pulse_support(w, chosen, tolerance, turned=turned) for w in waveforms)]
    for law, mesh in zip(scene.laws, scene.meshes, strict=True):
        if law.coherent:
            smooth = [pulse_support(w, chosen, tolerance, turned=turned, sloped=True) for w in waveforms]
            rough = [
                pulse_support(w, chosen, tolerance, turned=turned, rough=2.0 * law.rms_roughness / SLOWEST)
                for w in waveforms
                if law.rms_roughness > 0
            ]
            corner = 2.0 * farthest_corner(mesh) / SLOWEST
            supports += [(before + corner, after + corner) for before, after in smooth + rough]
    return np.asarray(np.max(supports, axis=0))


def blur_of(scene: Scene) -> float:
    """By how much (s) rough boundaries and bodies lengthen the pulses that they reflect and leave anything of."""
    environment, bounces = scene.world.environment, scene.physics.tracing.bounces
    heights = [law.rms_roughness for law in scene.laws]
    roughest = max(rms_height(environment.surface), rms_height(environment.bottom))
    height = np.hypot(max(heights, default=0.0), roughest * np.sqrt(bounces))
    if not height > 0.0:
        return 0.0
    delay_std = 2.0 * height / SLOWEST  # at the steepest grazing angle
    silent = max((silencing_blur(w, scene.sonar.antialias) for w in extreme_waveforms(scene)), default=0.0)
    return float(PULSE_FEET * min(delay_std, silent))


def extreme_waveforms(scene: Scene) -> list[Waveform]:
    """What each source may sound like at the most: as its model, as long as it may become, and as short."""
    waveforms = []
    for source in scene.world.sources:
        model, longest = source.model(scene.world.environment.depth), source.largest_scales[1]
        waveforms += [at_longest(waveform(model, width)) for width in sorted({1.0, longest, 1.0 / longest})]
    return waveforms
