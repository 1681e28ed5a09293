"""Pictures of a store: drawn from a store of a known, closed-form scene."""

from __future__ import annotations

import sys
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from sonarsynth.conventions import azimuth_elevation, direction
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.pictures import show
from sonarsynth.pictures.compare import moment
from sonarsynth.pictures.steered_beams import beams, choose
from sonarsynth.pictures.store_reading import opened, stored
from sonarsynth.pictures.summary import summary

SPEED = 1540.0
RATE = 196e3
BAND = (25e3, 85e3)


@dataclass(frozen=True)
class Size:
    frames: int = 3
    side: int = 8  # hydrophones on a side
    pitch: float = 0.1
    beams: int = 31
    rings: int = 12
    samples: int = 2200


def ellipsoid(rings: int) -> tuple[np.ndarray, np.ndarray]:
    """A closed body 1.6 m long along x and 0.2 m across."""
    import trimesh

    ball = trimesh.creation.uv_sphere(radius=1.0, count=[rings, rings])
    return ball.vertices * [0.8, 0.1, 0.1], ball.faces


def pulse(time: np.ndarray) -> np.ndarray:
    a = (np.pi * 50e3 * time) ** 2
    return (1 - 2 * a) * np.exp(-a)


def _add(pressure: np.ndarray, delay: np.ndarray, amplitude: np.ndarray) -> None:
    """A pulse at each sensor (delay in s after sample 0), over the 16 samples where it is not nothing."""
    first = np.floor(delay * RATE).astype(int) - 7
    samples = first[:, None] + np.arange(16)
    pressure[np.arange(len(delay))[:, None], samples] += amplitude[:, None] * pulse(samples / RATE - delay[:, None])


def make_store(
    path: Path, size: Size, *, groups: str = "signals image cloud source_estimates", unbuilt: int = 0
) -> Path:
    """A store with the documented variables: an ellipsoid 12 m ahead that moves to the right, and a square array."""
    y = (np.arange(size.side) - (size.side - 1) / 2) * size.pitch
    sensors = np.stack([np.zeros(size.side**2), *map(np.ravel, np.meshgrid(-y, -y))], axis=1)
    angle = np.linspace(-15.0, 15.0, size.beams)
    grid = direction(*np.deg2rad(np.meshgrid(angle, angle)))  # (elevation, azimuth, xyz)
    vertices, faces = ellipsoid(size.rings)
    sonar = Pose(np.array([0.0, 0.0, -5.0]), quaternion(0.5 * np.pi))
    snap = np.array([[6.0, -4.0, -4.0]])
    frames = [_frame(size, sonar, snap, vertices, faces, sensors, grid, step) for step in range(size.frames)]
    for hidden in range(unbuilt):
        frames[-1 - hidden] = {
            name: np.full(value.shape, -1 if value.dtype.kind == "i" else np.nan) for name, value in frames[0].items()
        }
    tree = _tree(frames, groups.split(), size, angle, sensors, vertices, faces)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # zarr on text arrays and on consolidated metadata
        tree.to_zarr(path, zarr_format=3, consolidated=True)
    return path


def _frame(size, sonar, snap, vertices, faces, sensors, grid, step) -> dict[str, np.ndarray]:
    target = Pose(np.array([12.0, 1.0 - 1.0 * step, -5.2]), quaternion(np.deg2rad(150.0)))
    there = sonar.to_body(target.to_world(vertices))
    corners = there[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    points = corners.mean(axis=1)[(normal * corners.mean(axis=1)).sum(axis=1) < 0]
    s = snap[0]
    out = np.linalg.norm(points - s, axis=1)
    back = np.linalg.norm(points[:, None] - sensors, axis=2)
    direct = np.linalg.norm(sensors - s, axis=1)
    start = np.linalg.norm(s) / SPEED - 1.0e-3
    time = start + np.arange(size.samples) / RATE
    pressure = np.zeros((len(sensors), size.samples))
    _add(pressure, direct / SPEED - start, 100.0 / direct)
    for i in range(len(points)):
        _add(pressure, (out[i] + back[i]) / SPEED - start, 1.0 / (out[i] * back[i]))
    true_range, facet = _cast(there, faces, grid)
    true = np.where(facet >= 0, true_range, 12.0)
    window = (np.linalg.norm(s) / SPEED + 6.7e-3, np.linalg.norm(s) / SPEED + 9.2e-3)  # echoes at 7.2 to 8.6 ms
    energy = _image(pressure, time, window, sensors, grid)
    on = (facet >= 0) & (energy > energy.max() / 30)
    found = np.where(on, true + 0.01 * np.sin(np.arange(true.size)).reshape(true.shape), np.nan)
    cloud = grid * found[..., None]
    path = np.linalg.norm(cloud - s, axis=2) + found - np.linalg.norm(s)
    points = {"range": found, "range_error": 0.02, "true_range": true, "energy": energy, "delay": path / SPEED}
    points |= dict(zip("xyz", np.moveaxis(cloud, -1, 0), strict=True))
    points |= dict(zip(("azimuth", "elevation"), np.rad2deg(azimuth_elevation(grid)), strict=True))
    points = {name: (values, np.nan) for name, values in points.items()}
    points["target"] = (np.where(facet >= 0, 0, -1).astype(np.int16), np.int16(-1))
    points |= {name: (np.int16(0), np.int16(-1)) for name in ("emission", "family", "lit_by", "origin")}
    return {
        "/trajectory": np.array(0),
        "/step": np.array(step),
        "/time": np.array(0.1 * step),
        "signals/pressure": pressure.astype(np.float32),
        "signals/start": np.array(start),
        "image/energy": energy.astype(np.float32),
        "image/start": np.array(window[0]),
        "image/stop": np.array(window[1]),
        **{f"cloud/{name}": np.where(on, values, none).ravel() for name, (values, none) in points.items()},
        "source_estimates/time": np.array([np.linalg.norm(s) / SPEED]),
        "source_estimates/position": snap + 0.01,
        "source_estimates/position_covariance": 1e-4 * np.eye(3)[None],
        **{f"source_estimates/{name}": np.array([0], np.int16) for name in ("emission", "reason")},
        **{f"source_estimates/{name}": np.array([0.0]) for name in ("azimuth", "elevation")},
        **{f"source_estimates/{name}_error": np.array([1e-7]) for name in ("time", "azimuth", "elevation")},
        "truth/emissions/arrival": np.array([np.linalg.norm(s) / SPEED]),
        **{f"truth/emissions/{name}": np.array([0.0]) for name in ("azimuth", "elevation")},
        "truth/sonar_position": sonar.position,
        "truth/sonar_orientation": sonar.orientation,
        "truth/targets/position": target.position[None],
        "truth/targets/orientation": target.orientation[None],
        "truth/targets/scale": np.array([1.0]),
        "truth/targets/mesh": np.array([0], np.int32),
        "truth/targets/visible_fraction": np.array([1.0]),
        "truth/targets/box": np.stack(np.meshgrid(*np.stack([there.min(0), there.max(0)], 1)), -1).reshape(1, 8, 3),
        "truth/emissions/position": sonar.to_world(snap),
        "truth/emissions/time": np.array([0.0]),
        "truth/beams/target": np.where(facet >= 0, 0, -1).astype(np.int16),
        "truth/beams/range": np.where(facet >= 0, true_range, np.nan).astype(np.float32),
    }


def _cast(vertices, faces, grid) -> tuple[np.ndarray, np.ndarray]:
    """Nearest facet along each beam, by the plane equation of every facet."""
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    matrix = np.linalg.pinv(np.stack([a, b, c], axis=2))  # direction = corners @ weights, weights >= 0 inside
    weights = np.einsum("fij,...j->...fi", matrix, grid)
    inside = (weights >= -1e-12).all(axis=-1)
    distance = np.where(inside, 1.0 / np.maximum(weights.sum(axis=-1), 1e-12), np.inf)
    facet = distance.argmin(axis=-1)
    nearest = distance.min(axis=-1)
    return nearest, np.where(np.isfinite(nearest), facet, -1)


def _image(pressure, time, window, sensors, grid) -> np.ndarray:
    inside = (time >= window[0]) & (time <= window[1])
    spectra = np.fft.rfft(pressure[:, inside], axis=1)
    frequency = np.fft.rfftfreq(int(inside.sum()), 1 / RATE)
    band = (frequency >= BAND[0]) & (frequency <= BAND[1])
    u = grid.reshape(-1, 3)
    lead = (
        np.linalg.norm(12.0 * u[:, None] - sensors, axis=2) - 12.0
    ) / SPEED  # (beam, sensor) s later than the centre
    energy = np.zeros(len(u))
    for f, x in zip(frequency[band], spectra[:, band].T, strict=True):
        energy += np.abs(np.exp(2j * np.pi * f * lead) @ x / len(sensors)) ** 2
    return (2 * energy / RATE / inside.sum()).reshape(grid.shape[:2])


def _tree(frames, groups, size, angle, sensors, vertices, faces) -> xr.DataTree:
    beam = ("frame", "elevation", "azimuth")
    dims = {
        "signals/pressure": ("frame", "sensor", "sample"),
        **dict.fromkeys(
            (
                "source_estimates/time",
                *(f"source_estimates/{n}" for n in ("emission", "reason", "azimuth", "elevation")),
            ),
            ("frame", "estimate"),
        ),
        **{f"source_estimates/{name}_error": ("frame", "estimate") for name in ("time", "azimuth", "elevation")},
        **{f"truth/emissions/{name}": ("frame", "emission") for name in ("arrival", "azimuth", "elevation")},
        "source_estimates/position": ("frame", "estimate", "xyz"),
        "source_estimates/position_covariance": ("frame", "estimate", "xyz", "xyz_other"),
        "truth/sonar_position": ("frame", "xyz"),
        "truth/sonar_orientation": ("frame", "wxyz"),
        "truth/targets/position": ("frame", "target", "xyz"),
        "truth/targets/orientation": ("frame", "target", "wxyz"),
        **{f"truth/targets/{name}": ("frame", "target") for name in ("visible_fraction", "scale", "mesh")},
        "truth/targets/box": ("frame", "target", "corner", "xyz"),
        "truth/emissions/position": ("frame", "emission", "xyz"),
        "truth/emissions/time": ("frame", "emission"),
    }
    sets: dict[str, xr.Dataset] = {"/": xr.Dataset(), "truth": xr.Dataset()}
    for name in frames[0]:
        group, _, variable = name.rpartition("/")
        if group and not group.startswith("truth") and group not in groups:
            continue
        values = np.stack([frame[name] for frame in frames])
        axes = dims.get(name, beam if values.ndim == 3 else ("frame", "point") if values.ndim == 2 else ("frame",))
        sets.setdefault(group or "/", xr.Dataset())[variable] = (axes, values)
    for name in {"truth/beams", "image"} & set(sets):
        sets[name] = sets[name].assign_coords(azimuth=angle, elevation=angle)
    sets["truth/targets"] = sets["truth/targets"].assign_coords(target=["hull"], group=("target", ["hull"]))
    if "signals" in sets:
        sets["signals"]["position"] = (("sensor", "xyz"), sensors)
        sets["signals"]["outside"] = sets["signals"]["clipped"] = ("frame", np.zeros(len(frames), int))
        sets["signals"]["gain"] = ("sensor", np.ones(len(sensors)))
        sets["signals"]["sampling_frequency"] = RATE
    sets["targets/hull"] = xr.Dataset({"vertices": (("vertex", "xyz"), vertices), "faces": (("face", "corner"), faces)})
    sets["/"].attrs = {
        "title": "An ellipsoid",
        "band_low": BAND[0],
        "band_high": BAND[1],
        "assumed_sound_speed": SPEED,
        "aperture_radius": float(np.linalg.norm(sensors, axis=1).max()),
    }
    return xr.DataTree.from_dict(sets)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_store(tmp_path_factory.mktemp("shown") / "hull.zarr", Size(), unbuilt=1)


@pytest.fixture(scope="module")
def shown(store: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[list[Path], list[str]]:
    said: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PATH", "")  # no ffmpeg
        return show(store, tmp_path_factory.mktemp("pictures"), say=said.append), said


def test_a_film_and_a_sheet_are_written(shown: tuple[list[Path], list[str]]) -> None:
    from PIL import Image

    files, said = shown
    assert [file.name for file in files] == ["sheet.png", "film.gif"]
    with Image.open(files[0]) as drawn, Image.open(files[1]) as film:
        assert drawn.size[0] > 1000
        assert film.n_frames == 2  # the frames that were built
    assert "2 of 3 built" in said[0]


def test_the_summary_agrees_with_the_closed_form(shown: tuple[list[Path], list[str]]) -> None:
    text = shown[1][0]
    assert f"hull: {len(ellipsoid(Size().rings)[1])} facets, 12.00 to 12.04 m away, in sight in 2 frames" in text
    assert f"median error {0.01 * np.sqrt(3):.3g} m" in text  # every coordinate of the located snap is 1 cm off


def test_the_summary_counts_the_facets_of_all_meshes_that_a_target_has(store: Path) -> None:
    tree = opened(store).load()
    mesh = tree["targets/hull"].to_dataset()
    tree["targets/hull"] = xr.DataTree.from_dict({"0": mesh.isel(face=slice(7)), "1": mesh})
    tree["truth/targets/mesh"][:] = [[1], [0], [-1]]
    assert f"hull: 7 to {mesh.sizes['face']} facets, " in summary(tree, store)
    tree["truth/targets/position"][1] = np.nan  # there in the first frame alone
    assert f"hull: {mesh.sizes['face']} facets, " in summary(tree, store)
    tree["truth/targets/position"][:] = np.nan
    assert "hull: in none of these frames\n" in summary(tree, store)


def test_of_very_many_frames_some_are_judged_and_all_are_counted(store: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.modules[summary.__module__], "JUDGED", 1)
    text = summary(opened(store), store)
    assert "2 of 3 built" in text and "in sight in 2 frames" in text
    assert "1 of these frames" in text and "brightest beam on target: 1 of 1 frames" in text


def test_beams_hear_the_echo_when_the_truth_says(store: Path) -> None:
    tree = opened(store)
    hit, far_hit, miss = beams(tree, stored(tree, 0))
    for beam in (hit, far_hit):
        heard = beam.time[np.abs(beam.pressure).argmax()]
        assert heard == pytest.approx(beam.expected, abs=0.15e-3)  # the beam is as wide as a third of the hull
        assert beam.expected == pytest.approx(beam.measured, abs=0.03 / SPEED)
    assert far_hit.expected > hit.expected
    assert np.abs(miss.pressure).max() < np.abs(hit.pressure).max() / 2
    assert np.isnan(miss.expected)


def test_the_steered_beam_has_the_energy_of_the_image(store: Path) -> None:
    tree = opened(store)
    frame = stored(tree, 0)
    azimuth = np.linspace(-15.0, 15.0, Size().beams)
    assert frame.energy is not None
    for beam in beams(tree, frame)[:2]:
        row, column = np.abs(azimuth - beam.elevation).argmin(), np.abs(azimuth - beam.azimuth).argmin()
        assert np.sum(beam.pressure**2) / RATE == pytest.approx(frame.energy[row, column], rel=0.02)


def test_hit_far_hit_and_miss_are_what_they_are_called(store: Path) -> None:
    frame = stored(opened(store), 1)
    angle = np.linspace(-15.0, 15.0, Size().beams)
    chosen = choose(frame, angle, angle, np.array([1.5, 1.5]))
    on = frame.target >= 0
    assert on[chosen["close hit"]]
    assert on[chosen["far hit"]]
    assert frame.true_range[chosen["close hit"]] < np.median(frame.true_range[on]) < frame.true_range[chosen["far hit"]]
    rows, columns = np.nonzero(on)
    away = np.hypot(rows - chosen["far miss"][0], columns - chosen["far miss"][1]) * (angle[1] - angle[0])
    assert away.min() >= 1.5 * 1.5


def test_nothing_built_is_said_in_one_line(tmp_path: Path) -> None:
    empty = make_store(tmp_path / "empty.zarr", Size(frames=1, side=2, beams=7, rings=6), unbuilt=1)
    with pytest.raises(ValueError, match=r"empty\.zarr: no frame has been built yet$"):
        show(empty, say=lambda _: None)


@pytest.mark.parametrize("groups", ["cloud source_estimates", "image", "signals", ""])
def test_what_a_store_lacks_is_left_out_and_said(tmp_path: Path, groups: str) -> None:
    small = make_store(tmp_path / "part.zarr", Size(frames=1, side=4, beams=15, rings=8), groups=groups)
    said: list[str] = []
    assert [file.name for file in show(small, tmp_path / "out", say=said.append)] == ["sheet.png"]
    (note,) = [line for line in said if line.startswith("sheet: without")]
    assert set(note.split(": without ")[1].split(", which")[0].split(", ")) == {"signals", "image", "cloud"} - set(
        groups.split()
    )


def test_ffmpeg_gets_every_frame_whole(store: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fake = tmp_path / "bin" / "ffmpeg"
    fake.parent.mkdir()
    fake.write_text('#!/bin/sh\nfor last in "$@"; do :; done\n/usr/bin/env wc -c > "$last"\n')
    fake.chmod(0o755)
    monkeypatch.setenv("PATH", f"{fake.parent}:/usr/bin:/bin")
    files = show(store, tmp_path, say=lambda _: None)
    assert files[1].name == "film.mp4"
    assert int(files[1].read_text()) == 2 * 1100 * 560 * 4  # frames, columns, rows, rgba


def test_a_broken_ffmpeg_leaves_a_gif(store: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fake = tmp_path / "ffmpeg"
    fake.write_text("#!/bin/sh\ncat > /dev/null\nexit 1\n")
    fake.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    assert show(store, tmp_path, say=lambda _: None)[1].name == "film.gif"


def test_levels_are_relative_to_one_beam_of_all_frames_or_to_one_of_each(store: Path) -> None:
    tree = opened(store)
    brightest = max(float(stored(tree, i).energy.max()) for i in (0, 1))
    common = [moment([tree], [brightest], i).panels[0].level for i in (0, 1)]
    each = [moment([tree], [None], i).panels[0].level for i in (0, 1)]
    assert max(level.max() for level in common) == pytest.approx(0.0, abs=1e-6)
    assert min(level.max() for level in common) < -1e-3
    for one, other in zip(common, each, strict=True):
        assert other.max() == 0.0
        np.testing.assert_allclose(one - other, one.max(), atol=1e-6)
