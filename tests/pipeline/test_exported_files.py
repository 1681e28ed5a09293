"""Images, boxes, signals and beams of a store, read back by the libraries of those formats."""

from __future__ import annotations

import contextlib
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from scipy.special import j1

import sonarsynth as ss
from sonarsynth import planning, schedule
from sonarsynth.cli import app
from sonarsynth.cli.running import run
from sonarsynth.description import FieldError
from sonarsynth.export.coco_files import DECIBELS, grey, write_coco
from sonarsynth.export.sonar_netcdf import write_sonar_netcdf
from sonarsynth.recipe import reading
from sonarsynth.store import Mismatch

BUILT = [2, 3, 4]
WIDEST = 0.1
"""rad: beside the axis of a beam, within its main lobe."""
MANDATORY = {
    "beam",
    "ping_time",
    "backscatter_r",
    "beam_stabilisation",
    "beam_type",
    "beamwidth_receive_major",
    "beamwidth_receive_minor",
    "blanking_interval",
    "equivalent_beam_angle",
    "non_quantitative_processing",
    "platform_heading",
    "platform_latitude",
    "platform_longitude",
    "platform_pitch",
    "platform_roll",
    "platform_vertical_offset",
    "rx_beam_rotation_phi",
    "rx_beam_rotation_psi",
    "rx_beam_rotation_theta",
    "sample_interval",
    "sample_time_offset",
    "transmit_duration_nominal",
    "transmit_frequency_start",
    "transmit_frequency_stop",
    "transmit_type",
    "tx_beam_rotation_phi",
    "tx_beam_rotation_psi",
    "tx_beam_rotation_theta",
}
"""Of a group of beams, by the tables of SONAR-netCDF4 2.0."""


@pytest.fixture(scope="module")
def store(small_text: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three frames of twenty, of a box before 20 hydrophones."""
    path = tmp_path_factory.mktemp("exported") / "s.zarr"
    text = small_text.replace("  trajectory:", "    ranges: {near: 6 m, far: 14 m, step: 10 cm}\n  trajectory:")
    plan = planning.plan(reading.loads(text), {"signals", "image", "range_image", "cloud"})
    assert schedule.build(plan, path, frames=BUILT, workers=0).ok
    return path


@pytest.fixture(scope="module")
def coco(store: Path) -> Path:
    folder = store.with_name("boxes")
    assert run(app, ["export", str(store), "--to", "coco", str(folder)]) == 0
    return folder


def test_coco_reads_boxes_and_masks(store: Path, coco: Path) -> None:
    from faster_coco_eval import COCO

    tree = ss.open(store)
    with contextlib.redirect_stdout(io.StringIO()):
        read = COCO(str(coco / "train.json"))
    assert sorted(read.imgs) == BUILT and [c["name"] for c in read.cats.values()] == ["target"]
    for annotation in read.anns.values():
        frame = annotation["image_id"]
        x, y, width, height = annotation["bbox"]
        box = tree["truth/targets/pixel_box"].values[frame, 0]
        assert [x, y, x + width, y + height] == pytest.approx(box.tolist(), abs=1e-12)
        mask = read.annToMask(annotation).astype(bool)
        np.testing.assert_array_equal(mask, tree["truth/beams/target"].values[frame] == 0)
        assert annotation["area"] == mask.sum() > 0
        centre = tree["truth/targets/box_centre"].values[frame, 0]
        assert annotation["range"] == pytest.approx(np.linalg.norm(centre))
    assert len(read.anns) == len(BUILT)


def test_coco_reads_boxes_and_masks_of_range_images(store: Path, coco: Path) -> None:
    from faster_coco_eval import COCO
    from PIL import Image

    tree = ss.open(store)
    with contextlib.redirect_stdout(io.StringIO()):
        read = COCO(str(coco / "train_ranges.json"))
    ranges = tree["range_image/range"].values
    for annotation in read.anns.values():
        frame = annotation["image_id"]
        mask = read.annToMask(annotation).astype(bool)
        np.testing.assert_array_equal(mask, tree["range_image/target"].values[frame] == 0)
        x, y, width, height = map(int, annotation["bbox"])
        assert not np.delete(mask, np.s_[x : x + width], axis=1).any() and mask[:, [x, x + width - 1]].any(axis=0).all()
        assert not np.delete(mask, np.s_[y : y + height], axis=0).any() and mask[[y, y + height - 1]].any(axis=1).all()
        assert ranges[y] - 0.1 < annotation["range"] < ranges[y + height - 1] + 1.0, "the near side is met"
        pixels = np.asarray(Image.open(coco / read.imgs[frame]["file_name"]))
        assert pixels.shape == mask.shape and pixels[mask].max() > 200, "the target is among the brightest cells"
    assert len(read.anns) == len(BUILT)


def test_images_are_levels_to_half_a_grey_value(store: Path, coco: Path) -> None:
    from PIL import Image

    for frame in BUILT:
        energy = ss.open(store)["image/energy"].values[frame]
        level = 10 * np.log10(energy / energy.max())
        read = np.asarray(Image.open(coco / "images" / f"{frame:06d}.png")).astype(float)
        seen = level > -DECIBELS
        back = DECIBELS * (read / 255.0 - 1.0)
        np.testing.assert_allclose(back[seen], level[seen], atol=0.5 * DECIBELS / 255.0 + 1e-6)
    assert grey(np.array([[1.0, 1e-4, 1e-9, 0.0]])).tolist() == [[255, 0, 0, 0]]
    assert not grey(np.zeros((1, 2), np.float32)).any(), "nothing is black"


def test_what_coco_scores_evaluate_scores(store: Path, coco: Path, tmp_path: Path) -> None:
    """Annotations as results: a detector that was trained on the export writes such a file."""
    results = [
        annotation | {"score": 0.5} for annotation in json.loads((coco / "train.json").read_text())["annotations"]
    ]
    (tmp_path / "results.json").write_text(json.dumps(results))
    figures = ss.evaluate(store, tmp_path / "results.json").as_json()
    assert figures["ap"] == figures["ap_distance"] == 1.0 and figures["classifies"]


def test_no_name_of_a_store_leads_out_of_the_folder(store: Path, tmp_path: Path) -> None:
    """Names and numbers of splits are a stranger's word."""
    tree = ss.open(store)
    numbers = tree["split"].copy(deep=True)
    meanings = {"flag_meanings": "../../outside <img/src=x> b"}
    tree.dataset = tree.to_dataset().assign_coords(split=("frame", numbers.values, meanings))
    files = write_coco(tree, tmp_path / "a" / "b", np.array(BUILT))
    assert files == tuple(tmp_path / "a" / "b" / f"train{of}.json" for of in ("", "_ranges")) and [
        f.name for f in tmp_path.iterdir()
    ] == ["a"]
    tree.dataset = tree.to_dataset().assign_coords(split=("frame", numbers.values + 7))
    with pytest.raises(Mismatch, match="7 is no number of a split"):
        write_coco(tree, tmp_path / "c", np.array(BUILT))


def test_times_before_the_motions_start_count_from_the_first_frame(store: Path, tmp_path: Path) -> None:
    """The convention's times have no sign."""
    import netCDF4

    tree = ss.open(store)
    seconds = tree["time"].values - 100.0
    tree.dataset = tree.to_dataset().assign_coords(time=("frame", seconds))
    (file,) = write_sonar_netcdf(tree, tmp_path, np.array(BUILT))
    with netCDF4.Dataset(file) as read:
        found = read["Sonar/Beam_group1/ping_time"][:].astype(float) / 1e9
    np.testing.assert_allclose(found, seconds[BUILT] - np.nanmin(seconds), atol=1e-9)


def test_netcdf_reads_what_the_convention_asks_and_the_same_numbers(store: Path) -> None:
    import netCDF4

    assert run(app, ["export", str(store), "--to", "sonar-netcdf"]) == 0
    tree = ss.open(store)
    with netCDF4.Dataset(store.with_name("s.zarr.sonar-netcdf") / "sequence_0.nc") as file:
        assert file.sonar_convention_name == "SONAR-netCDF4" and file.sonar_convention_version == "2.0"
        assert {"Environment", "Platform", "Provenance", "Sonar"} <= set(file.groups)
        heard, steered = file["Sonar/Beam_group1"], file["Sonar/Beam_group2"]
        for group in (heard, steered):
            assert set(group.variables) >= MANDATORY
        pressure = tree["signals/pressure"].values
        for row, frame in enumerate(BUILT):
            read = np.stack(list(heard["backscatter_r"][row, :, 0]))
            np.testing.assert_array_equal(read, pressure[frame])
            energy = np.concatenate(list(steered["backscatter_r"][row, :, 0]))
            np.testing.assert_array_equal(energy, tree["image/energy"].values[frame].ravel())
        rate = float(tree["signals/sampling_frequency"])
        np.testing.assert_allclose(heard["sample_interval"][:], 1.0 / rate, rtol=1e-6)
        np.testing.assert_allclose(-heard["sample_time_offset"][:, 0], tree["signals/start"].values[BUILT], rtol=1e-6)
        seconds = heard["ping_time"][:].astype(float) / 1e9
        np.testing.assert_allclose(seconds, tree["time"].values[BUILT], atol=1e-9)
        place = tree["signals/position"].values
        np.testing.assert_allclose(file["Platform/transducer_offset_y"][:], -place[:, 1], atol=1e-7)
        depth = -tree["truth/sonar_position"].values[BUILT, 2]
        np.testing.assert_allclose(heard["platform_vertical_offset"][:], depth, rtol=1e-6)
        down = np.array([0.0, 0.0, 1.0])
        turns = np.column_stack([steered[f"rx_beam_rotation_{a}"][0] for a in ("psi", "theta", "phi")])
        axes = Rotation.from_euler("ZYX", turns, degrees=True).apply(down)
        azimuth, elevation = np.meshgrid(np.deg2rad(tree["image/azimuth"]), np.deg2rad(tree["image/elevation"]))
        ours = [np.cos(elevation) * np.cos(azimuth), -np.cos(elevation) * np.sin(azimuth), -np.sin(elevation)]
        np.testing.assert_allclose(axes, np.stack(ours, axis=-1).reshape(-1, 3), atol=1e-6)
        assert str(steered["beam"][0]).startswith("azimuth -15")
        assert np.all(heard["equivalent_beam_angle"][:] == np.float32(4.0 * np.pi))
        sent = [name for name in heard.variables if name.startswith(("transmit_", "tx_", "beamwidth_transmit"))]
        assert len(sent) > 8 and all(
            np.ma.getmaskarray(heard[n][:]).all() or np.isnan(heard[n][:]).all() for n in sent
        ), "snaps are not sent"
        width = np.sqrt(np.prod([_widths(steered, n) for n in ("major", "minor")], axis=0))
        wide = brentq(lambda x: (2.0 * j1(x) / x) ** 2 - 0.5, 1.0, 2.0)  # at half the width, in ka sin(theta)
        lobes = [
            quad(lambda x, k: 2.0 * np.pi * x * (2.0 * j1(k * x) / (k * x)) ** 2, 1e-9, 90, (k,), limit=9000)[0]
            for k in wide / (0.5 * width)
        ]
        np.testing.assert_allclose(steered["equivalent_beam_angle"][0], lobes, rtol=0.02)
        for beam in np.flatnonzero(np.isin(azimuth, azimuth[0, [0, 5]]) & np.isin(elevation, elevation[[0, 4], 0])):
            for n, name in enumerate(("major", "minor")):
                across = _half_power_width(place, (azimuth.ravel()[beam], elevation.ravel()[beam]), n, tree.attrs)
                np.testing.assert_allclose(_widths(steered, name)[beam], across, rtol=0.03)


def _widths(group: Any, name: str) -> np.ndarray:
    return np.deg2rad(group[f"beamwidth_receive_{name}"][0].astype(float))


def _half_power_width(place: np.ndarray, axis: tuple[float, float], turn: int, attrs: dict[str, Any]) -> float:
    """Angle (rad) between the directions beside the axis of a beam in which the array hears half of the power, in
    azimuth (turn 0) or elevation (1), by the sum over its hydrophones."""
    k = 2.0 * np.pi * 0.5 * (attrs["band_low"] + attrs["band_high"]) / attrs["assumed_sound_speed"]

    def ahead(azimuth: float, elevation: float) -> np.ndarray:
        return np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])

    def over_half(angle: float) -> float:
        beside = ahead(*(value + angle * (n == turn) for n, value in enumerate(axis)))
        return float(abs(np.exp(1j * k * place @ (beside - ahead(*axis))).mean()) ** 2 - 0.5)

    angle = brentq(over_half, 0.0, WIDEST) - brentq(over_half, -WIDEST, 0.0)
    return float(angle * (np.cos(axis[1]) if turn == 0 else 1.0))


def test_netcdf_reads_what_a_transmitter_sends(small_text: str, tmp_path: Path) -> None:
    import netCDF4

    projector = """{kind: transmitter, name: projector, position: [0 m, 5 cm, 20 cm], source_level: 190 dB,
           pulse: {kind: sweep, start: 70 kHz, stop: 40 kHz, duration: 1 ms, law: hyperbolic},
           beam: {azimuth_width: 50 deg, elevation_width: 30 deg, azimuth: -10 deg, elevation: 5 deg}}"""
    head, _, tail = small_text.partition("    sources:")
    recipe = reading.loads(f"{head}    sources:\n      - {projector}\n  sonar:{tail.partition('  sonar:')[2]}")
    assert schedule.build(planning.plan(recipe, {"signals"}), tmp_path / "s.zarr", frames=BUILT, workers=0).ok
    tree = ss.open(tmp_path / "s.zarr")
    (file,) = write_sonar_netcdf(tree, tmp_path / "out", np.array(BUILT))
    hydrophones = tree.sizes.get("sensor", tree["signals"].sizes["sensor"])
    with netCDF4.Dataset(file) as read:
        assert read.keywords.startswith("active")
        heard, platform = read["Sonar/Beam_group1"], read["Platform"]
        sent = {name: heard[name][:, 0] for name in heard.variables if heard[name].dimensions[-1:] == ("tx_beam",)}
        assert (sent["transmit_type"] == 2).all() and (sent["transmit_transducer_index"] == hydrophones).all()
        assert platform["transducer_function"][:].tolist() == [0] * hydrophones + [1]
        place = [float(platform[f"transducer_offset_{axis}"][-1]) for axis in "xyz"]
        assert place == pytest.approx([0.0, -0.05, -0.2], abs=1e-6)
        expected = {
            "duration_nominal": 1e-3, "frequency_start": 70e3, "frequency_stop": 40e3, "source_level": 190.0 - 3.0103,
        }  # fmt: skip
        expected = {f"transmit_{name}": value for name, value in expected.items()}
        expected |= {"beamwidth_transmit_major": 50.0, "beamwidth_transmit_minor": 30.0}
        for name, value in expected.items():
            np.testing.assert_allclose(sent[name], value, rtol=1e-6)
        turns = [sent[f"tx_beam_rotation_{name}"][0] for name in ("psi", "theta", "phi")]
        axis = Rotation.from_euler("ZYX", turns, degrees=True).apply([0.0, 0.0, 1.0])
        azimuth, elevation = np.deg2rad([-10.0, 5.0])
        ours = [np.cos(elevation) * np.cos(azimuth), -np.cos(elevation) * np.sin(azimuth), -np.sin(elevation)]
        np.testing.assert_allclose(axis, ours, atol=1e-6)
    for wrong in ("a ping", [{"x": "1"}], [{"x": 0, "y": 0, "z": np.nan}], [{"x": 0, "y": 0, "z": 1, "type": "FM"}]):
        tree.attrs["transmitters"] = wrong
        with pytest.raises(FieldError, match=r"transmitters\.0: must have x, y and z"):
            write_sonar_netcdf(tree, tmp_path / "wrong", np.array(BUILT))


@pytest.mark.parametrize("wrong", ["wide", 0.4, [0.4], [0.4, 0.4, 0.4], [0.4, "high"]])
def test_an_extent_of_the_array_that_no_build_writes_is_refused(store: Path, tmp_path: Path, wrong: Any) -> None:
    tree = ss.open(store)
    tree.attrs["aperture_rms"] = wrong
    with pytest.raises(FieldError, match="aperture_rms: must be two numbers, m across and up"):
        write_sonar_netcdf(tree, tmp_path / "wrong", np.array(BUILT))


def test_beams_of_one_delay_have_no_interval(store: Path, tmp_path: Path) -> None:
    import netCDF4

    tree = ss.open(store)
    image = tree["image"].to_dataset()
    level = image["energy"].expand_dims(delay=[0.02], axis=-1)
    tree["beams"] = xr.DataTree(image.drop_vars("energy").assign(level=level))
    (file,) = write_sonar_netcdf(tree, tmp_path, np.array(BUILT))
    with netCDF4.Dataset(file) as read:
        steered = read["Sonar/Beam_group2"]
        assert np.isnan(steered["sample_interval"][:]).all() and len(steered["backscatter_r"][0, 0, 0]) == 1


def test_two_exports_do_not_mix(store: Path, coco: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = sorted(file.name for file in coco.rglob("*"))
    assert run(app, ["export", str(store), "--to", "sonar-netcdf", "--out", str(coco)]) == 2
    assert "exists already and is not an empty folder" in capsys.readouterr().err
    assert sorted(file.name for file in coco.rglob("*")) == before


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--to", "coco", "--frames", "5:8"], "none of these frames has been built"),
        (["--to", "coco", "--relative-to", "world"], "--relative-to is for point clouds"),
        (["--to", "sonar-netcdf", "--set", "seed=1"], "--set is for recipes"),
    ],
)
def test_bad_words_get_one_line(store: Path, capsys: pytest.CaptureFixture[str], options: list[str], said: str) -> None:
    assert run(app, ["export", str(store), *options]) == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1
