"""Meshes of many facets, or in the wrong unit: refused early, and caches that do not grow with what was seen."""

from __future__ import annotations

import functools
import gc
from pathlib import Path

import numpy as np
import pytest
import trimesh

from sonarsynth import FieldError
from sonarsynth.casting.ray_casting import casting_mesh
from sonarsynth.description import byte_bounded_cache as caching
from sonarsynth.description.byte_bounded_cache import ByteBoundedCache, byte_bounded_cache, size_of
from sonarsynth.geometry.curvature import bend
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.planning.notes import scene_checks
from sonarsynth.recipe import reading
from sonarsynth.scattering.facet_geometry import patches
from sonarsynth.scattering.random_signs import random_polarity
from sonarsynth.targets import target
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Sphere

REMUS = Path(__file__).resolve().parents[2] / "configs" / "remus.yaml"


def test_a_file_in_millimetres_is_refused_before_it_is_meshed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    trimesh.creation.box((1600.0, 200.0, 200.0)).export(tmp_path / "hull.stl")

    def meshed(*_: object) -> Mesh:
        raise AssertionError("meshed")

    monkeypatch.setattr(target, "base_mesh", meshed)
    shape = f"{{kind: mesh_file, path: {tmp_path / 'hull.stl'}}}"
    sets = (f"scene.world.targets.0.shape={shape}", "scene.physics.scattering={kind: kirchhoff}")
    scene = reading.load(REMUS, (sets[0].replace("}", ", unit: m}"), sets[1])).scene_of(0)
    with pytest.raises(FieldError, match=r"'remus', 1\.6e\+03 m long with numbers in m, is .* m above the surface"):
        scene_checks.read_inputs(scene)
    for unit in (", unit: mm}", "}"):  # by the size of its numbers
        scene = reading.load(REMUS, (sets[0].replace("}", unit), sets[1])).scene_of(0)
        with pytest.raises(AssertionError, match="meshed"):
            scene_checks.read_inputs(scene)


def test_bodies_in_the_water_that_their_boxes_leave() -> None:
    """A corner of the box round a turned sphere is out of the water, the sphere is not; then it is too."""
    for shape, height in ((Sphere(radius=1.0), 0.0), (Sphere(radius=1.0), 0.1)):
        recipe = reading.load(
            REMUS,
            (
                f"scene.world.targets.0.shape={{kind: sphere, radius: {shape.radius}}}",
                f"scene.world.targets.0.motion={{kind: still, position: [20, 0, {height - 1.0}], heading: 45 deg, "
                "pitch: 30 deg}",
            ),
        )
        scene, frame = recipe.frame(0)
        if height == 0.0:
            scene_checks.check_frame(scene, frame)
        else:
            with pytest.raises(FieldError, match=r"'remus' is 0\.[01][0-9]* m above the surface at frame 0"):
                scene_checks.check_frame(scene, frame)


def test_caches_of_meshes_are_bounded_whatever_was_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(caching, "MOST_BYTES", 4_000_000)
    caches = [
        one for one in gc.get_objects() if isinstance(one, ByteBoundedCache) and one.__module__.startswith("sonarsynth")
    ]
    for cache in caches:
        cache.cache_clear()  # what was kept under the real bound
    for n in range(50):
        mesh = mesh_of(Sphere(radius=0.5 + 0.01 * n))
        casting_mesh(mesh)
        patches(mesh)
        bend(mesh)
        random_polarity(mesh)
    assert len(caches) >= 7
    grown = size_of(mesh, casting_mesh(mesh))  # the last mesh has grown since it was kept
    for cache in caches:
        assert cache.nbytes <= 4_000_000 + grown or len(cache) <= caching.LEAST, cache.__qualname__
    assert max(len(cache) for cache in caches) < 50 < 2 * sum(len(cache) for cache in caches)


def test_no_cache_of_the_package_grows_without_bound() -> None:
    """All are bounded in number; those without a bound take no arguments."""
    for one in gc.get_objects():
        if isinstance(one, functools._lru_cache_wrapper) and str(one.__module__).startswith("sonarsynth"):
            if str(one.__module__).startswith("sonarsynth.validation"):
                continue  # a table of one run
            assert one.cache_info().maxsize is not None or one.__wrapped__.__code__.co_argcount == 0, one.__qualname__


def test_kept_results_are_the_last_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[int] = []

    @byte_bounded_cache(8)
    def zeros(count: int) -> np.ndarray:
        made.append(count)
        return np.zeros(count)

    monkeypatch.setattr(caching, "MOST_BYTES", 8 * 1000)
    for count in (100, 101, 102, 103, 104, 100):
        assert len(zeros(count)) == count
    assert made == [100, 101, 102, 103, 104]  # all fit
    zeros(900)
    assert len(zeros) == caching.LEAST  # type: ignore[arg-type]
    assert zeros(100) is zeros(100) and made[-1] == 900  # the last stay
    zeros(101)
    assert made[-1] == 101  # the first went
    monkeypatch.setattr(caching, "MOST_BYTES", 10**9)
    for count in range(20):
        zeros(count)
    assert len(zeros) == 8  # type: ignore[arg-type]


def test_sizes_count_arrays_once() -> None:
    array = np.zeros(1000)
    assert size_of((array, [array[10:], {"a": array}])) == 8000 == size_of(array, array)
    plain = mesh_of(Sphere(radius=0.5))
    mesh = Mesh(plain.vertices.copy(), plain.faces.copy())
    assert size_of(mesh) == mesh.vertices.nbytes + mesh.faces.nbytes
    assert mesh.area.shape == mesh.centroid.shape[:1]  # each is made where it is asked for
    assert (
        size_of((mesh, mesh.normal))
        == size_of(mesh)
        == sum(getattr(mesh, name).nbytes for name in ("vertices", "faces", "area", "normal", "centroid"))
    )
    ready = casting_mesh(mesh)
    assert size_of(ready) > ready.vertices.nbytes + ready.faces.nbytes + 50 * len(mesh.faces)  # and Embree's own
