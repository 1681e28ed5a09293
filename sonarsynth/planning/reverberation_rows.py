"""The row of a plan for reverberation: its families, their levels, what its speckle errs by, and what it costs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.equations.reverberation.speckle import SINC, scatterers_per_pulse
from sonarsynth.planning.measured.reverberation_levels import reverberation_levels
from sonarsynth.planning.noise_rows import NoiseRow
from sonarsynth.planning.plan_tables import Omission
from sonarsynth.signals.pulse_sums.reverberation_synthesis import path_error

if TYPE_CHECKING:
    from sonarsynth.planning.plans import Plan

REVERBERATION = "reverberation"
"""The stage."""
PATH_SECONDS, SAMPLE_SECONDS, CELL_SECONDS = 6e-9, 7e-9, 8e-3
"""Of one core: a scatterer at a sensor, a sample of a sensor, the cells of a frame."""


def reverberation_rows(plan: Plan) -> list[NoiseRow]:
    """One row, where anything scatters. Raises FieldError where a boundary has no strength."""
    described, levels = plan.scene.world.reverberation, reverberation_levels(plan)
    if described is None or levels is None:
        return []
    families = ", ".join(f"{name} {level:.0f} dB" for name, _, level in levels.families if np.isfinite(level))
    method = f"{described.row()}; {levels.scatterers} scatterers in the first frame"
    why = f"{families or 'nothing'} re 1 uPa in the echo window; noise of a beam {levels.noise:.0f} dB"
    error = plan.recipe.accuracy.speckle
    per_pulse = scatterers_per_pulse(error, shape=SINC)
    of_path = 100.0 * path_error(plan.elements, plan.scene.sonar, float(plan.profile.speed.min()))
    bound = (
        f"{error:.2g} of the contrast at a hydrophone: {per_pulse:.2g} scatterers in 1/bandwidth; "
        f"{of_path:.2g} % of each path"
    )
    sizes = plan.sizes
    seconds = levels.scatterers * sizes["sensor"] * PATH_SECONDS + CELL_SECONDS
    seconds += sizes["sensor"] * sizes["sample"] * SAMPLE_SECONDS
    return [(REVERBERATION, method, why, bound, seconds, 0)]


def reverberation_left_out(plan: Plan) -> list[Omission]:
    """What of reverberation is not simulated, and by how much."""
    described, levels = plan.scene.world.reverberation, reverberation_levels(plan)
    if described is None or levels is None:
        return []
    rows = [
        Omission(
            f"reverberation of the {name}", "far under the rest, or under the noise of a beam", f"{level:.0f} dB re all"
        )
        for name, level in levels.left_out
    ]
    return [
        *rows,
        Omission(
            f"reverberation by more than {described.bounces} reflections beside",
            "reverberation.bounces",
            "each more loses what boundaries and spreading take",
        ),
        Omission(
            "change of scattering strengths within the band", "as at its centre", f"{levels.edges:.1f} dB at its edges"
        ),
        *_diffraction(plan),
        Omission("Doppler within the pulses of reverberation", "delays follow the sonar", "v/c of a pulse's length"),
        Omission(
            "speckle of single beams", "few scatterers fall into one", "contrast over 2; raise it by accuracy.speckle"
        ),
        Omission("reverberation of the chorus", "its snaps light nothing", "that of a snap of its level and place"),
    ]


def _diffraction(plan: Plan) -> list[Omission]:
    """How far diffraction would blur the shadows of bodies in the first frame of the sequence: by the first Fresnel
    zone at the body, sqrt(wavelength d1 d2/(d1 + d2)), which is less than sqrt(wavelength d1) whatever is behind it.

    Source: Born and Wolf (1999), Principles of Optics, 8.7.3.
    """
    frame = plan.recipe.frame(plan.recipe.first_frame(plan.sequence))[1]
    seen_from = [frame.sonar_pose.position, *(snap.position for snap in frame.moment.snaps if snap.illuminates)]
    bodies = frame.moment.bodies
    if not bodies:
        return []
    far = max(float(np.linalg.norm(body.pose.position - place)) for body in bodies for place in seen_from)
    blur = np.sqrt(plan.profile.speed.max() / plan.scene.sonar.band.centre * far)
    return [
        Omission(
            "diffraction at the edges of shadows in the reverberation",
            "bodies hide scatterers along rays",
            f"blurred over up to {blur:.2g} m; a narrower shadow is less deep",
        )
    ]
