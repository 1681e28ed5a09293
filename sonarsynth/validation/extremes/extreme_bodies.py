"""Spheres of a millimetre to 10 m by every law, against the exact series; bodies at every bearing; a relief of the
bottom up to the surface, and needles."""

from __future__ import annotations

import re
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from sonarsynth.conventions import Floats, direction
from sonarsynth.equations.scattering.modal_series import sphere_amplitude
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.labels import label
from sonarsynth.pipeline import trace_frame
from sonarsynth.planning import plan
from sonarsynth.products import Arrivals, View
from sonarsynth.propagation import Straight
from sonarsynth.receiver import POINT, BeamGrid, Romanis, Sonar, elements
from sonarsynth.recipe import Recipe
from sonarsynth.scattering import FacetLaw, Isotropic, Kirchhoff, MirrorLobe, Scatterer
from sonarsynth.scattering.law_validity import OFF
from sonarsynth.state import FrameContext, Medium, Receiver
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.relief import Relief
from sonarsynth.targets.shapes import Box, MeshFile, Sphere
from sonarsynth.targets.target import base_mesh
from sonarsynth.validation.extremes.extreme_chains import recipe
from sonarsynth.validation.extremes.outcomes import Case, CaseResult, holds, off, refused, together
from sonarsynth.validation.extremes.plain_scenes import POSE, PROFILE, WATER, C, body, snap, traced, transfer

BESIDE = np.array([0.0, 1e-6, 0.0])
"""A source so near the array that what it hears is backscatter."""
SPHERES = ((1e-3, 25e3), (1e-2, 25e3), (0.1, 25e3), (1.0, 4e3), (10.0, 400.0))
"""Radii (m), each with the bottom (Hz) of a band of 3.4 times it: that of the default sonar, or one that a mesh of some
thousand facets serves."""
LAWS: tuple[MirrorLobe | Kirchhoff, ...] = (
    MirrorLobe(),
    MirrorLobe(width=0.1),
    Kirchhoff(),
    Kirchhoff(surface="soft"),
)
MESHED = 0.6
"""dB: of the mesh (5 %), and of 200 radii of distance."""


def echo(law: FacetLaw, mesh: Mesh, radius: float, frequency: Floats) -> Floats:
    """Target strength (frequency,) in dB re 1 m2 of what a frame has of a sphere 200 radii off."""
    far = 200.0 * radius
    band = float(frequency[0]), float(frequency[-1])
    arrivals = traced([snap(BESIDE)], POINT, [body(mesh, (far, 0.0, 0.0))], [law], band)
    arrivals = arrivals.select(~arrivals.direct)
    if law.coherent:
        return np.asarray(20.0 * np.log10(np.abs(transfer(arrivals, frequency)) * far**2))
    return np.full(len(frequency), 10.0 * np.log10(float((arrivals.amplitude**2).sum()) * far**4))


def _law(law: MirrorLobe | Kirchhoff) -> CaseResult:
    """Each sphere is as exact as the law says without a word, or as far off as its note says."""
    soft = isinstance(law, Kirchhoff) and law.surface == "soft"
    boundary: Literal["rigid", "soft"] = "soft" if soft else "rigid"
    results = []
    for radius, low in SPHERES:
        frequency = np.geomspace(low, 3.4 * low, 9)
        shape = Sphere(radius=radius, edge=radius / 8.0)
        mesh = base_mesh(shape, law, C / frequency[-1])
        exact = sphere_amplitude(frequency, np.pi, radius=radius, sound_speed=C, boundary=boundary)
        error = echo(law, mesh, radius, frequency) - 20.0 * np.log10(np.abs(exact))
        note = law.too_small(Scatterer(mesh, C / frequency[-1], C / frequency[0]))
        if note is None:
            results.append(off(error, OFF + MESHED, "dB", f"{radius:g} m, unsaid:"))
            continue
        lowest, highest = map(float, re.findall(r"[-+]\d+\.\d", note))
        within = bool((error >= lowest - MESHED).all() and (error <= highest + MESHED).all())
        results.append(holds(within, f"{radius:g} m: {error.min():+.1f} to {error.max():+.1f} dB off, and said to be"))
    return together(*results)


def _isotropic() -> CaseResult:
    """Whatever the size: a strength for each facet that is lit and seen, and a note that it is no body's."""
    law, results = Isotropic(strength=0.01), []
    for radius, low in SPHERES:
        mesh = mesh_of(Sphere(radius=radius, edge=radius / 4.0))
        lit = int((mesh.normal[:, 0] < 0.0).sum())
        level = echo(law, mesh, radius, np.array([low, 3.4 * low]))[0]
        results.append(off(level - 20.0 * np.log10(0.01) - 10.0 * np.log10(lit), 0.1, "dB", f"{radius:g} m:"))
        notes = " ".join(law.validity(Scatterer(mesh, C / (3.4 * low), C / low)))
        results.append(holds("not the level of a body" in notes, "noted"))
    return together(results)


def _bearings() -> CaseResult:
    """Bounds within the view, mirrored with the bearing, none exactly where a flag says so."""
    beams, mesh = BeamGrid(azimuths=3, elevations=3), mesh_of(Box(size=(0.5, 3.0, 1.0)))
    receiver = Receiver(POSE, elements(Romanis()), Sonar(beams=beams))
    edge, results, flags = 0.5 * beams.azimuth_span, [], set()
    for bearing in np.deg2rad(np.arange(0.0, 181.0, 5.0)):
        boxes = []
        for azimuth in (bearing, -bearing):
            target = body(mesh, 5.0 * direction(np.array(azimuth), np.array(0.0)), 0.5 * np.pi - azimuth)
            context = FrameContext(0.0, (target,), (), Medium(WATER, PROFILE), receiver)
            labels = label(context, Straight(), np.zeros(0))
            boxes.append(labels.image_box[0])
            flags.add(int(labels.view[0]))
            none = bool(np.isnan(boxes[-1]).all())
            results.append(holds(none == (labels.view[0] > View.PARTLY_IN_VIEW), "a box, or a flag"))
            results.append(holds(none or bool((np.abs(boxes[-1]) <= edge + 1e-12).all()), "within the view"))
        left, right = boxes
        results.append(off(np.nan_to_num(left + right[[1, 0, 2, 3]] * [1, 1, -1, -1]), 1e-9, "rad", "mirrored:"))
    expected = {View.IN_VIEW, View.PARTLY_IN_VIEW, View.OUTSIDE_VIEW, View.BEHIND}
    return together(results, holds(flags == expected, f"flags {sorted(flags)}"))


def _relief() -> CaseResult:
    """A wall before the snap, of nearly the depth and of all of it; one too low to be any; a needle beside the way."""
    base, results = recipe(((Sphere(radius=0.5, edge=0.3), (20.0, 0.0, 0.0)),)), []

    def over(height: float, x: Floats, y: Floats) -> Recipe:
        z = np.zeros((3, 4))
        z[:, 1:3] = height
        np.savez(path, x=x, y=y, z=z)
        relief = Relief(shape=MeshFile(path=str(path), edge=1e3))
        return replace(base, scene=replace(base.scene, world=replace(base.scene.world, relief=relief)))

    def heard(sea: Recipe) -> Arrivals:
        return trace_frame(plan(sea, ("signals",)), 0).arrivals

    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "relief.npz"
        wall, needle = np.array([7.0, 7.1, 7.2, 7.3]), np.array([9.0, 9.001, 9.002, 9.003])
        wide, thin = np.array([-500.0, 0.0, 500.0]), np.array([9.0, 9.001, 9.002])
        plain = heard(base)
        results += [refused(lambda: heard(over(40.0, wall, wide)), "rises 40 m over a bottom that is 40 m deep")]
        hidden = heard(over(39.999, wall, wide))
        results += [holds(not hidden.direct.any(), "no snap behind a wall up to a millimetre under the surface")]
        for words, arrivals in (
            ("nothing of a rise of 9 cm", heard(over(0.09, wall, wide))),
            ("all of the snap beside a needle of 30 m", heard(over(30.0, needle, thin))),
        ):
            same = bool(np.array_equal(arrivals.delay[arrivals.direct], plain.delay[plain.direct]))
            results += [holds(same and bool(np.isfinite(arrivals.amplitude).all()), words)]
    return together(results)


CASES = (
    *(
        Case(
            f"spheres of 1 mm to 10 m, {law.kind} {what}".strip(),
            f"the exact series within {OFF:g} dB and the mesh, or as far off it as the note says",
            lambda law=law: _law(law),  # type: ignore[misc]
        )
        for law, what in zip(LAWS, ("", "of 0.1 rad", "rigid", "soft"), strict=True)
    ),
    Case("spheres of 1 mm to 10 m, isotropic", "as strong as asked for, and a note that no body is", _isotropic),
    Case(
        "a body at every bearing", "its box within the view, mirrored with it, or a flag that says why not", _bearings
    ),
    Case("a relief up to the surface, of no height, of a millimetre's width", "hides all, nothing, nothing", _relief),
)
