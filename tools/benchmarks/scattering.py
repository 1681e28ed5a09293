"""`tools/bench scattering`: what echoes of facets cost, and how near the exact series they are for it."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

import sonarsynth as ss
from sonarsynth.equations.scattering.kirchhoff_integral import facet_amplitude
from sonarsynth.equations.scattering.kirchhoff_kernels import facet_amplitudes, mesh_amplitude
from sonarsynth.equations.scattering.modal_series import sphere_amplitude
from sonarsynth.targets.mesh_resolution import CoarseMesh, fine_mesh
from sonarsynth.targets.meshes import mesh_of

SOUND_SPEED = 1500.0
BAND = np.linspace(25e3, 110e3, 18)
FACETS, SAMPLE = 250_000, 10_000
ASPECTS, WHOLE = 24, 361
RADIUS, OFF = 0.25, np.arange(0.0, 121.0, 4.0)
"""Sphere (m), and angles off backscatter (deg)."""


def seconds(work: Callable[[], Any], repeats: int = 1) -> tuple[float, Any]:
    """Least processor time of some runs, and what came out."""
    times, result = [], None
    for _ in range(repeats):
        began = time.process_time()
        result = work()
        times.append(time.process_time() - began)
    return min(times), result


def triangles() -> dict[str, float]:
    """The integral over many facets, of sides of 2 mm to 0.2 m, against the slow exact way on some of them."""
    rng = np.random.default_rng(1)
    corners = rng.normal(size=(FACETS, 1, 3)) + rng.normal(size=(FACETS, 3, 3)) * 10.0 ** rng.uniform(
        -3, -1, (FACETS, 1, 1)
    )
    there, k = np.array([0.48, 0.6, 0.64]), 2 * np.pi * BAND / SOUND_SPEED
    some = corners[:SAMPLE]
    for waves in (k[:1], k):
        mesh_amplitude(some, there, -there, waves)  # compiles
    one = seconds(lambda: mesh_amplitude(corners, there, -there, k[-1:]), 3)[0]
    many = seconds(lambda: mesh_amplitude(some, there, -there, k), 3)[0]
    slow, exact = seconds(lambda: facet_amplitude(some[:, None], there, -there, k), 3)
    got = facet_amplitudes(some, there, -there, k)
    size = np.linalg.norm(np.cross(some[:, 1] - some[:, 0], some[:, 2] - some[:, 0]), axis=1)[:, None] * k
    return {
        "facets": FACETS,
        "one_frequency_s": one,
        "one_frequency_ns_a_facet": 1e9 * one / FACETS,
        "all_frequencies_ns_a_facet_and_frequency": 1e9 * many / (SAMPLE * k.size),
        "slow_exact_ns_a_facet_and_frequency": 1e9 * slow / (SAMPLE * k.size),
        "slow_exact_over_compiled": slow / many,
        "largest_difference_over_area_and_wavelength": float((2 * np.pi * abs(got - exact) / (0.5 * size)).max()),
    }


def remus() -> dict[str, float]:
    """The whole target strength of REMUS over the band: one aspect with its mesh, and what each more adds."""
    shape = ss.Remus100()
    first, _ = seconds(lambda: ss.target_strength(shape, BAND, (1, 0, 0), (-1, 0, 0), SOUND_SPEED))
    again, _ = seconds(lambda: ss.target_strength(shape, BAND, (1, 0, 0), (-1, 0, 0), SOUND_SPEED))
    angle = 2 * np.pi * np.arange(ASPECTS) / ASPECTS + 0.01
    there = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)[:, None]
    many, _ = seconds(lambda: ss.target_strength(shape, BAND, there, -there, SOUND_SPEED))
    each = (many - again) / (ASPECTS - 1)
    return {
        "facets": len(fine_mesh(shape, SOUND_SPEED / BAND[-1]).faces),
        "frequencies": BAND.size,
        "one_aspect_with_mesh_s": first,
        "one_aspect_mesh_made_s": again,
        "each_more_aspect_ms": 1e3 * each,
        f"{WHOLE}_aspects_at_that_rate_s": again + (WHOLE - 1) * each,
    }


def sphere(edge: float) -> dict[str, float]:
    """A rigid sphere of facets with that edge (m): largest errors against the exact series, and time."""
    mesh = mesh_of(ss.Sphere(radius=RADIUS, edge=edge))
    angle = np.pi - np.radians(OFF)[:, None]
    there, across = np.array([0.48, 0.6, 0.64]), np.array([0.8, 0.0, -0.6])
    out = np.cos(angle) * there + np.sin(angle) * across
    exact = 20 * np.log10(abs(sphere_amplitude(BAND, angle, radius=RADIUS, sound_speed=SOUND_SPEED)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CoarseMesh)
        law = ss.Kirchhoff(edges="smooth")
        spent, got = seconds(lambda: ss.target_strength(mesh, BAND, there, out[:, None], SOUND_SPEED))
        tapered_spent, tapered = seconds(lambda: ss.target_strength(mesh, BAND, there, out[:, None], SOUND_SPEED, law))
    error, tapered_error = abs(got - exact), abs(tapered - exact)
    return {
        "facets": len(mesh.faces),
        "ms_an_aspect": 1e3 * spent / OFF.size,
        "backscatter_dB": float(error[0].max()),
        "up_to_120_degrees_dB": float(error.max()),
        "tapered_ms_an_aspect": 1e3 * tapered_spent / OFF.size,
        "tapered_up_to_120_degrees_dB": float(tapered_error.max()),
    }


def bench() -> dict[str, Any]:
    """Triangles, a whole body, and a sphere of ever finer facets: processor time on one core."""
    cut = triangles()
    sphere(0.1)  # compiles
    return {
        "triangles": cut,
        "remus": remus(),
        "rigid_sphere": [sphere(edge) for edge in (0.06, 0.03, 0.015, 0.0075)],
    }
