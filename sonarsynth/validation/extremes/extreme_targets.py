"""Targets of any size at any distance, facets of any shape and number, where a target must not be, and
populations of none and of five hundred."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.special import fresnel

from sonarsynth.conventions import Floats
from sonarsynth.equations.scattering.kirchhoff_integral import lit_sphere
from sonarsynth.equations.scattering.kirchhoff_kernels import mesh_amplitude
from sonarsynth.equations.scattering.modal_series import sphere_amplitude
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.pipeline import render
from sonarsynth.planning import plan
from sonarsynth.receiver import POINT
from sonarsynth.recipe import Recipe, reading
from sonarsynth.recipe.populations.population import BodyModel, Population
from sonarsynth.recipe.populations.regions import BoxRegion
from sonarsynth.scattering.isotropic import Isotropic
from sonarsynth.scattering.kirchhoff import Kirchhoff
from sonarsynth.scattering.mirror_lobe import MirrorLobe
from sonarsynth.targets.mesh_readers.mesh_repair import repair
from sonarsynth.targets.meshes import mesh_of, refined_mesh
from sonarsynth.targets.shapes import Box, Shape, Sphere
from sonarsynth.targets.target import base_mesh
from sonarsynth.targets.target_strength import target_strength
from sonarsynth.validation.extremes.extreme_chains import recipe
from sonarsynth.validation.extremes.outcomes import Case, CaseResult, holds, off, refused, together
from sonarsynth.validation.extremes.plain_scenes import C, body, snap, traced, transfer

BESIDE = np.array([0.0, 1e-6, 0.0])
"""A source so near the array that what it hears is backscatter."""


def echo(shape: Shape, far: float, band: tuple[float, float]) -> Floats:
    """The coherent echo (frequency,) at the ends of a band of a body whose middle is so far ahead (m)."""
    law = Kirchhoff()
    mesh = base_mesh(shape, law, C / band[1])
    arrivals = traced([snap(BESIDE)], POINT, [body(mesh, (far, 0.0, 0.0))], [law], band)
    return transfer(arrivals.select(~arrivals.direct), np.array(band))


def mirrored(radius: float, distance: float, band: tuple[float, float]) -> Floats:
    """What geometry says of a sphere so far before its middle (m): a/(2 R (R + a)), R to its nearest point, and 2R/c.

    A small one (k a under 1) has no mirror, but Kirchhoff's integral over its lit half.
    """
    f = np.array(band)
    R, k = distance - radius, 2.0 * np.pi * f / C
    if k.max() * radius > 1.0:
        return np.asarray(radius / (2.0 * R * distance) * np.exp(-2j * k * R))
    return np.asarray(lit_sphere(radius, k) / distance**2 * np.exp(-2j * k * distance))


def _sphere(radius: float, distance: float, band: tuple[float, float], allowed: float) -> CaseResult:
    computed, exact = echo(Sphere(radius=radius), distance, band), mirrored(radius, distance, band)
    return off(np.abs(computed / exact - 1.0), allowed, what=f"{2 * radius:g} m at {distance:g} m:")


def _distances() -> CaseResult:
    return together(*(_sphere(0.25, far, (40e3, 80e3), 0.05) for far in (1.0, 100.0, 1e4)))


def _sizes() -> CaseResult:
    """In a frame, in bands that suit them; and far away, where all sizes are alike at one k a."""
    results = [
        _sphere(0.5e-6, 1.0, (40e3, 80e3), 0.03),
        _sphere(0.5e-3, 1.0, (40e3, 80e3), 0.03),
        _sphere(500.0, 2e3, (60.0, 120.0), 0.05),
    ]
    direction, strengths = np.array([1.0, 0.0, 0.0]), []
    for radius in (0.5e-6, 0.5e-3, 0.5, 500.0):
        f = 30.0 * C / (2.0 * np.pi * radius)
        exact = 20.0 * np.log10(abs(complex(sphere_amplitude(f, np.pi, radius=radius, sound_speed=C))))
        strengths.append(float(target_strength(Sphere(radius=radius), f, direction, -direction, C)) - exact)
    spread = off(np.ptp(strengths), 1e-6, "dB", "1 um to 1 km at k a = 30, one from another:")
    return together(*results, spread, off(strengths, 0.25, "dB", "from the exact series:"))


def needles(count: int) -> Floats:
    """The unit square in z = 0 as a fan of triangles (facet, 3, xyz) from one corner, thinner towards an edge."""
    t = np.concatenate([[0.0], np.geomspace(1e-12, 1.0, count // 2)])
    right = np.stack([np.ones_like(t), t, 0 * t], axis=1)
    top = np.stack([1.0 - t, np.ones_like(t), 0 * t], axis=1)
    rim = np.concatenate([right, top[1:]]) - [0.5, 0.5, 0.0]
    apex = np.broadcast_to([-0.5, -0.5, 0.0], (len(rim) - 1, 3))
    return np.stack([apex, rim[:-1], rim[1:]], axis=1)


def _needles() -> CaseResult:
    corners = needles(400)
    results = []
    for tilt, turn in ((0.0, 0.0), (0.01, 0.3), (0.7, 0.0), (1.2, 2.0)):
        away = np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)])
        k = np.array([0.0, 1e-6, 1.0, 30.0, 300.0])
        half = k[:, None] * away  # half the change of the wave: sinc of the sides
        exact = 0.5j * k / np.pi * away[2] * np.sinc(half[:, 0] / np.pi) * np.sinc(half[:, 1] / np.pi)
        amplitude = mesh_amplitude(corners, -away, away, k)
        results.append(off(np.abs(amplitude - exact) / np.maximum(k, 1e-300), 1e-13, "of its area"))
    return together(results)


def _degenerate() -> CaseResult:
    """A cube with points and lines for facets, and its corners twice."""
    cube = mesh_of(Box(size=(1.0, 1.0, 1.0)))
    extra = np.array([[0, 0, 0], [0, 1, 1], [2, 3, 2]], np.int64)
    line = np.array([[0.0, 0.0, 0.5], [0.25, 0.25, 0.5], [0.5, 0.5, 0.5]])
    vertices = np.concatenate([cube.vertices, cube.vertices, line])
    n = len(cube.vertices)
    faces = np.concatenate([cube.faces, extra, [[2 * n, 2 * n + 1, 2 * n + 2]], cube.faces[:3] + n])
    (v, f), notes = repair((vertices, faces), "cube", shares_vertices=True)
    fixed = Mesh(np.ascontiguousarray(v), np.ascontiguousarray(f, np.int32))
    same = len(f) == len(cube.faces) and abs(fixed.area.sum() - 6.0) < 1e-12
    return together(
        holds(same and np.isfinite(fixed.normal).all(), f"{len(f)} facets of {fixed.area.sum():.12g} m2"),
        holds(any("without area" in n for n in notes) and any("repeated" in n for n in notes), "; ".join(notes)),
    )


def _many(facets: int, *, framed: bool) -> CaseResult:
    """A sphere of that many: its area, and Kirchhoff's integral over its lit half; framed: and its echo in a frame."""
    import resource

    radius = 0.5
    n = round(np.sqrt(facets / 20.0))
    mesh = refined_mesh(Sphere(radius=radius, edge=1.32 * radius / n))
    area, band, direction = 4.0 * np.pi * radius**2, (40e3, 80e3), np.array([1.0, 0.0, 0.0])
    count, closed = len(mesh.faces), np.abs(mesh.area @ mesh.normal).max()
    k = 2.0 * np.pi * np.array(band) / C
    lit = np.array_split(np.flatnonzero(mesh.normal[:, 0] > 0), count // 200_000)
    amplitude = sum(mesh_amplitude(mesh.corners[batch], -direction, direction, k) for batch in lit)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    results = [
        holds(count > 0.97 * facets, f"{count} facets"),
        off(closed / area, 1e-13, "of the area", "sum of the normals"),
        off(mesh.area.sum() / area - 1.0, 12.0 / count, what="area"),
        off(np.abs(amplitude / lit_sphere(radius, k) - 1.0), 20.0 / np.sqrt(count), what="Kirchhoff's integral"),
    ]
    if framed:
        arrivals = traced([snap(BESIDE)], POINT, [body(mesh, (8.0, 0.0, 0.0))], [Kirchhoff()], band)
        echoed = transfer(arrivals.select(~arrivals.direct), np.array(band))
        results.append(off(np.abs(echoed / mirrored(radius, 8.0, band) - 1.0), 0.01, what="echo in a frame"))
        lobe = traced([snap(BESIDE)], POINT, [body(mesh, (8.0, 0.0, 0.0))], [MirrorLobe(width=0.1)], band)
        power = float((lobe.amplitude[~lobe.direct] ** 2).sum()) / (radius / (2.0 * 7.5 * 8.0)) ** 2
        results.append(off(10.0 * np.log10(power), 0.3, "dB", "power of lobes"))
    return together(*results, holds(peak < 6.0, f"at most {peak:.2g} GB"))


def _between() -> CaseResult:
    """A plate half way: blocked without a word too many; or scattered forward, by Fresnel's integrals."""
    plate, half, f = Box(size=(0.01, 0.6, 0.6), edge=0.02), 0.3, np.linspace(40e3, 80e3, 5)
    mesh, source = mesh_of(plate), (20.0, 0.0, 0.0)
    blocked = traced([snap(source)], POINT, [body(mesh, (10.0, 0.0, 0.0))], [Kirchhoff()])
    results = [holds(len(blocked.delay) == 0, "blocked: no path")]
    for aside in (0.0, 0.1, 0.25, 0.4, 0.8):
        law = Kirchhoff(forward="scattered")
        arrivals = traced([snap(source)], POINT, [body(mesh, (10.0, aside, 0.0))], [law])
        pressure = transfer(arrivals, f) * 20.0 * np.exp(2j * np.pi * f * 20.0 / C)
        w = np.sqrt(2.0 * 20.0 * f / C / 100.0)
        spans = []
        for low, high in ((aside - half, aside + half), (-half, half)):
            (s0, c0), (s1, c1) = fresnel(low * w), fresnel(high * w)
            spans.append((c1 - c0) - 1j * (s1 - s0))
        exact = 1.0 - 0.5j * spans[0] * spans[1]
        results.append(off(np.abs(pressure - exact), 0.05, "of the direct", f"{aside:g} m off the line:"))
    return together(*results)


def _isotropic() -> CaseResult:
    """Ranges of an echo: a ball of a millimetre from 1 m to 10 km, its delay and power as of a point."""
    results, ball = [], mesh_of(Sphere(radius=1e-3))
    for far in (1.0, 30.0, 1e3, 1e4):
        source = np.array([0.3 * far, 0.4 * far, 0.0])
        arrivals = traced([snap(source)], POINT, [body(ball, (far, 0.0, 0.0))], [Isotropic(strength=0.01)])
        arrivals = arrivals.select(~arrivals.direct)
        out = float(np.linalg.norm(source - [far, 0.0, 0.0]))
        results.append(off(arrivals.delay * C - out - far, 2.1e-3, "m", f"{far:g} m: path"))
        loud = arrivals.amplitude / arrivals.scattering * out * far
        results.append(off(loud - 1.0, 3e-3, what="spreading"))
    return together(results)


BALLS = (BodyModel(shape=Sphere(radius=0.1, edge=0.1)),)
SEA = BoxRegion(low=(5.0, -30.0, -39.0), high=(65.0, 30.0, -1.0))


def _with(population: Population) -> Recipe:
    scene = recipe().scene
    return replace(recipe(), scene=replace(scene, world=replace(scene.world, populations=(population,))))


def _none_and_many() -> CaseResult:
    """A frame of no body, where there is room for 500, and a sequence of all of them."""
    none = _with(Population(name="ball", models=BALLS, most=500, region=SEA, weights=(1.0, *[0.0] * 500)))
    tree = render(plan(none, ("image",)), 0)
    truth = tree["truth/targets"].dataset
    bodies = _with(Population(name="ball", models=BALLS, least=500, most=500, region=SEA)).frame(0)[1].moment.bodies
    centre = np.array([body.pose.position for body in bodies])
    apart = np.linalg.norm(centre[:, None] - centre[None], axis=2) + 1e3 * np.eye(len(centre))
    return together(
        holds(
            truth.sizes["target"] == 500 and not truth["present"].values.any() and (truth["mesh"].values == -1).all(),
            "500 targets that are missing in a frame of none",
        ),
        holds(bool(np.isfinite(tree["image"].dataset["energy"].values).all()), "its image is one of silence"),
        holds(
            len(bodies) == 500 and float(apart.min()) > 0.2, f"500 balls, {apart.min():.2g} m apart where 0.2 m touch"
        ),
    )


def _no_room() -> CaseResult:
    small = BoxRegion(low=(10.0, 0.0, -10.0), high=(10.3, 0.3, -9.7))
    crowd = _with(Population(name="ball", models=BALLS, least=50, most=50, region=small))
    return refused(lambda: plan(crowd), "no room for body")


def _broken() -> CaseResult:
    """Of a folder of meshes one is empty, one is no mesh, one is missing; and a table that is none."""
    yaml = reading.dump(_with(Population(name="ball", models=BALLS, most=1, region=SEA)))
    head, _, tail = yaml.partition("models:")
    indent = head.rpartition("\n")[2]
    text = f"{head}models: {{table: hulls/all.csv}}\n{indent}least:{tail.partition('least:')[2]}"
    results = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "hulls").mkdir()
        (folder / "hulls/empty.stl").touch()
        (folder / "hulls/text.obj").write_text("no mesh\n")
        (folder / "r.yaml").write_text(text)
        for row, words in (
            ("file\nempty.stl", "empty.stl"),
            ("file\ntext.obj", "text.obj"),
            ("file\nnone.stl", "no such file"),
            ("file,weight\nempty.stl,much", "must be a plain number"),
            ("file,shape\nempty.stl,ball", "'shape' is no column"),
            ("file", "has no rows"),
            ("\x00\xff", "is no column"),
        ):
            (folder / "hulls/all.csv").write_text(row)
            results.append(refused(lambda: plan(reading.load(folder / "r.yaml")), words))
    return together(results)


ECHO = "geometry's a/(2R(R+a)) and 2R/c, within the mesh's 5 %"
CASES = (
    Case("targets at 1 m to 10 km", ECHO, _distances),
    Case("path and spreading from 1 m to 10 km", "those of a point, to its size", _isotropic),
    Case("targets of 1 um, 1 mm and 1 km", f"{ECHO}; Rayleigh's limit of small ones; all alike at one k a", _sizes),
    Case("needle triangles", "a plate of needles down to 1e-12 m: its sinc lobes, to 1e-13", _needles),
    Case("degenerate triangles", "dropped, and said so; the rest as it was", _degenerate),
    Case(
        "a million facets", "area and echo of the sphere, under 6 GB", lambda: _many(1_000_000, framed=True), slow=True
    ),
    Case(
        "10 million facets",
        "area and echo of the sphere, under 6 GB",
        lambda: _many(10_000_000, framed=False),
        slow=True,
    ),
    Case("a target on the baseline", "no path where it blocks; Fresnel's integrals where it scatters", _between),
    Case("no body, and 500 bodies", "missing in their slots; drawn, and none in another", _none_and_many),
    Case("a region without room", "refused in one line that names the population", _no_room),
    Case("a table of broken meshes", "each refused in one line", _broken),
)
