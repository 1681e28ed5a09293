"""Kirchhoff's facets, roughness and smoothed meshes at their limits."""

from __future__ import annotations

import numpy as np

from sonarsynth.equations.scattering.kirchhoff_kernels import mesh_amplitude
from sonarsynth.equations.scattering.roughness import coherent_factor, incoherent_power, roughness_parameter
from sonarsynth.geometry.surfaces import volume
from sonarsynth.receiver import POINT
from sonarsynth.scattering.kirchhoff import Kirchhoff
from sonarsynth.signals import GriddedSynthesis
from sonarsynth.targets.generated.generation import sphere
from sonarsynth.targets.generated.smoothing import curved
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Box
from sonarsynth.validation.extremes.outcomes import Case, CaseResult, holds, off, refused, together
from sonarsynth.validation.extremes.plain_scenes import body, snap, synthesised, traced, transfer

TRIANGLE = np.array([[0.2, -0.1, 0.0], [-0.15, 0.25, 0.0], [-0.05, -0.15, 0.0]])


def _waves() -> CaseResult:
    """In the mirror direction f is k A/2 pi at any k; elsewhere it falls; none at backscatter along the facet."""
    down, up, along = np.array([0.0, 0, -1.0]), np.array([0.0, 0, 1.0]), np.array([1.0, 0.0, 0.0])
    k = 10.0 ** np.arange(-12.0, 10.0)
    area = 0.5 * np.linalg.norm(np.cross(TRIANGLE[1] - TRIANGLE[0], TRIANGLE[2] - TRIANGLE[0]))
    mirror = np.abs(mesh_amplitude(TRIANGLE[None], down, up, k)) / (k * area / (2.0 * np.pi))
    tilted = np.array([np.sin(0.3), 0.0, np.cos(0.3)])
    off_mirror = np.abs(mesh_amplitude(TRIANGLE[None], -tilted, tilted, k)) / (k * area / (2.0 * np.pi) * tilted[2])
    return together(
        off(mirror - 1.0, 1e-14, what="mirror, k from 1e-12 to 1e9:"),
        off(np.abs(mesh_amplitude(TRIANGLE[None], along, -along, k)) / k, 1e-16, "m2", "grazing"),
        holds(
            bool((off_mirror <= 1.0 + 1e-14).all() and off_mirror[-1] < 1e-12),
            f"off it from {off_mirror[0]:.3g} down to {off_mirror[-1]:.2g}",
        ),
    )


def _mirror() -> CaseResult:
    """Through the mirror direction, from 1e-18 to 0.1 rad off it: the sinc of a square, no step anywhere."""
    square = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]])[[[0, 1, 2], [0, 2, 3]]]
    results, k = [], np.array([300.0])
    for tilt in (0.0, *10.0 ** np.arange(-18.0, 0.0)):
        away = np.array([np.sin(tilt), 0.0, np.cos(tilt)])
        change = k * np.sin(tilt)
        exact = k / (4.0 * np.pi) * (1.0 + np.cos(tilt)) * np.sinc(0.5 * change / np.pi)
        amplitude = mesh_amplitude(square, np.array([0.0, 0.0, -1.0]), away, k)
        results.append(off(np.abs(np.abs(amplitude) - np.abs(exact)) / k, 1e-14, "of k A"))
    return together(results)


def _rough() -> CaseResult:
    """No height: the smooth echo. Any height: the coherent and the incoherent share of the power are all of it."""
    mesh, band = mesh_of(Box(size=(0.1, 0.3, 0.3), edge=0.02)), (40e3, 80e3)
    f = np.array(band)
    smooth, rough = (
        transfer(
            traced([snap((0.0, 0.1, 0.0))], POINT, [body(mesh, (5.0, 0.0, 0.0))], [Kirchhoff(roughness=h)], band), f
        )
        for h in (0.0, 1e-15)
    )
    down, up = np.array([0.0, 0, -1.0]), np.array([0.0, 0, 1.0])
    g = roughness_parameter(300.0, np.array([0.0, 1e-200, 1e-9, 1e-3, 0.1, 1e200]), down, up, up)
    lobe = 1.0 / (8.0 * np.pi * 0.2**2)  # of the slopes, in the mirror direction
    shares = coherent_factor(g) ** 2 + incoherent_power(g, down, up, up, 0.2) / lobe
    return together(
        off(np.abs(rough / smooth - 1.0), 1e-9, what="a height of 1e-15 m:"),
        off(shares - 1.0, 1e-14, what="shares of the power, from none to 1e200 m:"),
    )


def _rough_frame() -> CaseResult:
    """So rough that nothing is coherent: the powers of the facets are the lobe of the slopes, times their area."""
    mesh, at = mesh_of(Box(size=(0.1, 0.2, 0.2), edge=0.02)), 30.0
    law = Kirchhoff(roughness=0.3, slope=0.2)
    arrivals = traced([snap((0.0, 1e-6, 0.0))], POINT, [body(mesh, (at, 0.0, 0.0))], [law])
    arrivals = arrivals.select(~arrivals.direct)
    power = float((arrivals.amplitude[~arrivals.coherent] ** 2 * arrivals.coherent_fraction[~arrivals.coherent]).sum())
    exact = 0.2 * 0.2 / (8.0 * np.pi * 0.2**2) / (at - 0.05) ** 4
    return off(10.0 * np.log10(power / exact), 0.01, "dB")


def _large() -> CaseResult:
    """Facets too long for their echo to be a pulse in a window are refused; and a body of one huge facet a side."""
    plate = mesh_of(Box(size=(1.0, 2e3, 2e3)))
    snaps = [snap((1.0, 900.0, 0.0))]
    paths = traced(snaps, POINT, [body(plate, (3e3, 0.0, 0.0))], [Kirchhoff()])
    return refused(
        lambda: synthesised(GriddedSynthesis(), paths, snaps, POINT, 3.9, 100), "corners that are not within"
    )


def _smoothing() -> CaseResult:
    """Twenty facets become a sphere; a cube stays a cube; needles and far places change nothing."""
    results = []
    for scale, away in ((1.0, 0.0), (1e-3, 0.0), (1e3, 0.0), (1.0, 100.0)):
        vertices, faces = sphere(1.0, 2.0)  # an icosahedron
        moved, _ = curved((scale * vertices + away, faces), 0.1 * scale, np.inf, 1.0)
        results.append(
            off(np.linalg.norm(moved - away, axis=1) / scale - 1.0, 1e-9, what=f"{scale:g} m, {away:g} m away:")
        )
    cube = mesh_of(Box(size=(1.0, 1.0, 1.0)))
    smoothed = curved((cube.vertices, cube.faces.astype(np.int64)), 0.2, 1e-4, 0.7)
    results.append(off(volume(smoothed) - 1.0, 1e-12, "m3", "a cube:"))
    thin = mesh_of(Box(size=(1.0, 1e-6, 1.0)))
    needle = curved((thin.vertices, thin.faces.astype(np.int64)), 0.2, 1e-4, 0.7)
    results.append(off(volume(needle) / 1e-6 - 1.0, 1e-6, what="a sheet of 1 um:"))
    return together(*results)


CASES = (
    Case("facets at wavenumbers of 1e-12 to 1e9", "k A/(2 pi) in the mirror, none along the facet", _waves),
    Case("through the mirror direction", "the sinc of a square, to 1e-14", _mirror),
    Case("roughness from none to 1e200 m", "the smooth echo; shares of power that sum to one", _rough),
    Case("a very rough plate in a frame", "the lobe of its slopes, to 0.01 dB", _rough_frame),
    Case("facets of a kilometre", "refused, with the reason", _large),
    Case(
        "smoothing of 20 facets, a cube and a sheet",
        "a sphere to 1e-9; the cube and the sheet as they were",
        _smoothing,
    ),
)
