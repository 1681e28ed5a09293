"""How long pulses are, as the sonar hears them: what windows must hold of them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from sonarsynth.conventions import SLOWEST, Floats
from sonarsynth.environment.boundary_numbers import rms_height
from sonarsynth.geometry.mesh import farthest_corner
from sonarsynth.planning.measured.sampled_frames import SampledScene
from sonarsynth.planning.plans import PulseDurations
from sonarsynth.receiver import Sonar, elements
from sonarsynth.recipe.scene import Scene
from sonarsynth.signals import pulse_support
from sonarsynth.signals.filtered_pulse import PULSE_FEET, at_longest, envelope_delay, silencing_blur
from sonarsynth.sources.snap_pulses import Waveform, waveform

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
FOOT = 1e-2
"""Where the direct pulse is in the way, feet of echoes under this part of their peak may be cut."""


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
    return PulseDurations(*(float(n) for n in np.max(rows, axis=0)))


def _direct(scene: Scene) -> float:
    """Longest time (s) before or after the peak of its envelope that any filtered snap exceeds `DIRECT` of its peak."""
    sonar, longest = scene.sonar, 0.0
    for shape in extreme_waveforms(scene):
        (before, after), late = pulse_support(shape, sonar.antialias, DIRECT), envelope_delay(shape, sonar)
        longest = max(longest, before + late, after - late)
    return longest


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
