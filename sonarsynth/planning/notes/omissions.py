"""What a plan leaves out, and the bound on what that costs: rows that `sonarsynth plan` prints."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import counted
from sonarsynth.environment.boundary_numbers import rms_height
from sonarsynth.environment.casts import profile_of
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.planning.choices import ALL_PRODUCTS
from sonarsynth.planning.measured.ray_bending import bending_error
from sonarsynth.planning.measured.sampled_arrivals import one_facet_in
from sonarsynth.planning.notes.formula_validity import curved_waves
from sonarsynth.planning.notes.motion_rows import motion_left_out
from sonarsynth.planning.plan_tables import Omission
from sonarsynth.planning.plans import Plan
from sonarsynth.planning.reverberation_rows import reverberation_left_out
from sonarsynth.propagation.bounces import MOST_BOUNCES
from sonarsynth.receiver import stop_frequency
from sonarsynth.recipe.rising_bottom import relief_of
from sonarsynth.recipe.scene import Frame
from sonarsynth.scattering import MirrorLobe
from sonarsynth.signals.chorus.chorus_arrivals import FAINT
from sonarsynth.state import FrameContext, Receiver, Tolerances
from sonarsynth.targets.mesh_resolution import expected_error
from sonarsynth.targets.relief import BOTTOM, highest_within
from sonarsynth.tracing.arrivals import trace

ENOUGH = 2500
"""Facets of a target that its reflections are estimated from."""


def left_out(plan: Plan) -> tuple[Omission, ...]:
    """What is not computed, why, and the bound on what that costs."""
    if not plan.products:
        return (Omission("sound: paths, levels, signals, image, cloud", "only ground truth is requested", "0"),)
    scene, frame = plan.recipe.frame(0)
    environment = scene.world.environment
    rows = []
    if not plan.propagation.bends:
        rows.append(Omission("refraction", "straight rays", _refraction_bound(plan, frame)))
    bounces = plan.propagation.bounces
    reflected = f"paths by at most {counted(bounces, 'reflection')} at surface and bottom in all"
    families = reflected if bounces else "the direct family"
    rows.append(Omission("more reflections", f"requested: {families}", reflected_bound(plan)))
    rows += curved_waves(plan)
    rough = [b for b in (environment.surface, environment.bottom) if rms_height(b) > 0.0]
    if bounces and rough and scene.world.reverberation is None:
        rows.append(
            Omission(
                "scattering by rough boundaries",
                "reflections are coherent",
                "the energy lost to roughness is not simulated as scattered sound",
            )
        )
    if environment.absorption.formula != "none":
        bound = f"{plan.absorption_error:.1g} dB on any path within the band; none at its centre if rays are straight"
        rows.append(
            Omission("depth dependence of the absorption spectrum", "one absorption spectrum for all paths", bound)
        )
    rows += _facets_leave_out(plan) + _relief_left_out(plan)
    rows += motion_left_out(plan, frame) + _chorus_left_out(plan) + reverberation_left_out(plan)
    if not environment.noises:
        rows.append(Omission("ambient noise", "none in the recipe", "signals are free of noise"))
    return tuple(rows + _below_bottom(plan) + _not_asked_for(plan) + _not_traced(plan) + _not_heard(plan))


def _relief_left_out(plan: Plan) -> list[Omission]:
    """What mirror reflections do not have of the relief of the bottom."""
    relief, slowest = relief_of(plan.scene), float(plan.profile.speed.min())
    if relief is None:
        return []
    highest, up = float(relief.box[1, 2]), relief.normal[:, 2] > 0.0
    area = float((relief.area * relief.normal[:, 2])[up].sum())
    early = f"up to {2e3 * highest / slowest:.2g} ms early over its {area:.3g} m2"
    hidden, points = _mirror_points_under(plan, relief)
    lost = f"of the first frame's {points} by the bottom {hidden} are under it: lost, not {early}"
    rows = [Omission("relief in mirror reflections", "they are at the mean plane", lost)]
    if least := plan.scene.world.relief.least if plan.scene.world.relief else 0.0:
        bound = f"mirror reflections up to {2e3 * least / slowest:.2g} ms early; no slopes that scatter"
        rows.append(Omission(f"relief of less than {least:.3g} m", "it would hide the mean plane under it", bound))
    if plan.scene.world.chorus is not None:
        why = "snaps are on the mean plane, and nothing hides them"
        rows.append(Omission("relief in the chorus", why, f"{area:.3g} m2 are heard through it"))
    return rows


def _mirror_points_under(plan: Plan, relief: Mesh) -> tuple[int, int]:
    """How many mirror reflections by the bottom alone are under a relief, in the first frame, and how many there are:
    from snaps to the array and to targets, and from these to the array, straight."""
    frame, depth = plan.recipe.frame(plan.recipe.first_frame(plan.sequence))[1], plan.medium.depth
    bodies = [b.pose.position for b in frame.moment.bodies if b.name != BOTTOM]
    own, snaps = frame.sonar_pose.position, [s.position for s in frame.moment.snaps]
    pairs = [(a, b) for a in snaps for b in (own, *bodies)] + [(a, own) for a in bodies]
    heights = [(max(a[2] + depth, 0.0), max(b[2] + depth, 0.0)) for a, b in pairs]
    points = [
        a + (b - a) * (x / (x + y) if x + y > 0.0 else 0.5) for (a, b), (x, y) in zip(pairs, heights, strict=True)
    ]
    return sum(highest_within(relief, point[:2], 0.0) > 0.0 for point in points), len(points)


def _chorus_left_out(plan: Plan) -> list[Omission]:
    """What of the other snaps of the sea is not simulated."""
    chorus, reach = plan.scene.world.chorus, plan.chorus
    if chorus is None or reach is None:
        return []
    far = f"snaps beyond {reach.reach:.4g} m, and images by more than {reach.images} reflections"
    reason, bound = "the chorus is heard one snap at a time", f"{reach.beyond:.1f} dB re all of the chorus"
    if (distant := plan.distant_chorus) is not None:
        far = f"single snaps beyond {reach.reach:.4g} m, and images by more than {reach.images} reflections"
        reason = "Gaussian noise of their spectrum, from their directions"
        bound = f"no power; excess kurtosis {distant.kurtosis:.2g} of the whole"
    rows = [
        Omission(far, reason, bound),
        Omission(
            "echoes of the chorus off targets", "its snaps light nothing", "those of a snap of its level and place"
        ),
        Omission("refraction of the chorus", "straight rays at the mean slowness", "angles err by r g/(2 c)"),
    ]
    faint = f"paths of the chorus under {reach.level - FAINT:.0f} dB re 1 uPa"
    rows.append(Omission(faint, "faint", f"each {-FAINT:g} dB re the rms pressure of all of it"))
    return rows


def _not_asked_for(plan: Plan) -> list[Omission]:
    """What the products of this build do not need."""
    rows = [Omission(name, "not requested", "0") for name in ALL_PRODUCTS if name not in plan.products]
    if "signals" not in plan.products:
        why = "signals are not stored, so there is nothing to compare with it"
        rows.append(Omission("the loudest path of each kind by itself", why, "0"))
    elif plan.scene.sonar.converter is None:
        rows.append(Omission("converter", "none in the recipe", "0: pressure is stored as float32"))
    return rows


def _refraction_bound(plan: Plan, frame: Frame) -> str:
    if plan.profile.uniform:
        return "0: uniform sound speed"
    bound = bending_error(plan.propagation, plan.scene, plan.profile, [frame])
    if bound <= plan.recipe.accuracy.signal:
        return f"{bound:.1g} of the signals"
    varies = np.ptp(plan.profile.speed)
    return f"requested, but the sound speed varies by {varies:.3g} m/s: angles and delays are biased"


def _below_bottom(plan: Plan) -> list[Omission]:
    """Nodes of a profile that are not needed."""
    left = len(profile_of(plan.scene.world.environment.sound_speed).depth) - len(plan.profile.depth)
    why = f"{left} of {left + len(plan.profile.depth)}: no sound goes there"
    return [Omission("nodes of the sound speed below the bottom", why, "0")] if left else []


def _not_traced(plan: Plan) -> list[Omission]:
    """Paths that are not traced by themselves, or not kept."""
    rows: list[Omission] = []
    choices, count = plan.choices, plan.elements.count
    if choices.subarrays < count:
        receivers = "the array" if choices.subarrays == 1 else f"each of {choices.subarrays} subarrays"
        measured = np.isfinite(plan.errors.expansion)
        bound = f"{plan.errors.expansion:.1g} of the signals, measured" if measured else "not measured"
        rows.append(Omission("rays to each hydrophone", f"paths are expanded over {receivers}", bound))
    if choices.negligible > 0.0:
        bound = f"{np.sqrt(choices.negligible):.1g} of the echo of each target"
        rows.append(
            Omission("the faintest echoes", f"{-10 * np.log10(choices.negligible):.3g} dB below their sum", bound)
        )
    rows.append(Omission("facets that are occluded or face away", "no ray reaches them", "0"))
    return rows


def _not_heard(plan: Plan) -> list[Omission]:
    """Hydrophones and frequencies that are not computed."""
    rows: list[Omission] = []
    dead, sonar = int((plan.elements.gain == 0.0).sum()), plan.scene.sonar
    if dead:
        rows.append(Omission(f"{dead} dead hydrophones", "their gain is 0", "0"))
    chosen = sonar.antialias
    rows.append(
        Omission(
            f"the spectrum above {stop_frequency(chosen) / 1e3:.4g} kHz",
            "the filter stops it",
            f"attenuated by {chosen.attenuation:g} dB",
        )
    )
    return rows


def _facets_leave_out(plan: Plan) -> list[Omission]:
    """What coherent facets do not have of an echo."""
    scene, rows = plan.scene, []
    for target, law, mesh in zip(scene.world.targets, scene.laws, scene.meshes, strict=True):
        if law.coherent:
            error = expected_error(mesh, scene.sonar.shortest_wavelength)
            bound = f"about {100.0 * error:.2g} % of the echo at the top of the band"
            if error > 0.995:
                bound = "all of the echo at the top of the band"
            if error == 0.0:
                bound = "0: it has no curved surface"
            rows.append(Omission(f"curvature within facets of {target.name}", f"{len(mesh.faces)} flat facets", bound))
    if rows:
        bound = (
            "spheres of circumference over 26 wavelengths: 0.3 dB within 60 degrees of backscatter, 2.6 dB within 120"
        )
        rows.append(Omission("creeping waves and waves inside bodies", "facets are plane mirrors", bound))
    return rows


def reflected_bound(plan: Plan) -> str:
    """Level of what one reflection more would add in the first frame, over the echoes that are kept.

    By a lobe where targets are coherent (powers of facets add), and of `ENOUGH` of their facets, about, where there are
    more: a level to go by, at little cost.
    """
    scene, frame = plan.recipe.frame(0)
    sonar, bounces = scene.sonar, plan.propagation.bounces
    if not frame.moment.snaps or bounces >= MOST_BOUNCES:
        return "not computed"
    laws = tuple(MirrorLobe() if law.coherent else law for law in scene.laws)
    bodies, receiver = frame.moment.bodies, Receiver(frame.sonar_pose, plan.elements, sonar)
    fewer = Tolerances(every=one_facet_in(plan.profile, sum(len(body.mesh.faces) for body in bodies), ENOUGH))
    context = FrameContext(frame.time, bodies, frame.moment.snaps, plan.medium, receiver, laws, fewer)
    levels, powers = [], []
    for most in (bounces, bounces + 1):
        arrivals = trace(context, plan.propagation.reflected(most))
        delay_std = np.exp(-0.5 * (2 * np.pi * sonar.band.centre * arrivals.delay_std) ** 2)
        power = (arrivals.amplitude * delay_std) ** 2
        powers.append([float(power[mask].sum()) for mask in (~arrivals.direct, arrivals.direct)])
    for name, traced, every in zip(("echoes", "snap itself"), *powers, strict=True):
        if every > traced > 0.0:
            levels.append(f"{name} {10 * np.log10(every / traced - 1.0):+.1f} dB")
    return "one reflection more would add, re the paths kept in frame 0: " + (", ".join(levels) or "nothing")
