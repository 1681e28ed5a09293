"""From a store to a judged detector: `detect`, its file, and `evaluate`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import sonarsynth as ss
from sonarsynth import detection, schedule
from sonarsynth.cli import app
from sonarsynth.cli.running import run
from sonarsynth.evaluation.detectors import true_objects
from sonarsynth.recipe import reading

BUILT = [2, 3, 4]


@pytest.fixture(scope="module")
def store(small_text: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three frames of twenty, of a ball before 96 hydrophones."""
    text = small_text.replace("columns: 5, rows: 4", "columns: 12, rows: 8")
    text = text.replace("{kind: box, size: [1, 1, 1], edge: 0.25}", "{kind: sphere, radius: 0.4, edge: 0.1}")
    made = reading.loads(text.replace("azimuths: 11, elevations: 9", "azimuths: 21, elevations: 21"))
    path = tmp_path_factory.mktemp("detectors") / "s.zarr"
    assert schedule.build(made, path, frames=BUILT, workers=0, products={"image", "cloud"}).ok
    return path


def test_the_truth_is_what_the_store_says(store: Path) -> None:
    tree = ss.open(store)
    found, targets = true_objects(tree, np.array(BUILT)), tree["truth/targets"].dataset.isel(frame=BUILT)
    assert found.frame.tolist() == BUILT
    np.testing.assert_array_equal(found.box, targets["pixel_box"].values[:, 0])
    centre = targets["box_centre"].values[:, 0]
    np.testing.assert_allclose(found.range, np.linalg.norm(centre, axis=1))
    azimuth, elevation = np.deg2rad(found.azimuth), np.deg2rad(found.elevation)
    np.testing.assert_allclose(found.range * np.cos(elevation) * np.cos(azimuth), centre[:, 0])
    np.testing.assert_allclose(found.range * np.sin(elevation), centre[:, 2])
    np.testing.assert_allclose(found.visible, targets["visible_fraction"].values[:, 0])
    bow = np.deg2rad(targets["yaw"].values[:, 0])  # level, as the sonar is: the angle to the direction of the sonar
    expected = np.arccos(-np.cos(elevation) * np.cos(bow - azimuth))
    np.testing.assert_allclose(np.deg2rad(found.aspect), expected, atol=1e-6)
    np.testing.assert_array_equal(found.snr, targets["snr"].values[:, 0])
    assert found.snr.min() > 3.0
    energy = tree["image/energy"].isel(frame=BUILT).values
    tree["truth/targets"] = tree["truth/targets"].dataset.drop_vars("snr")  # of a store from before it was stored
    found = true_objects(tree, np.array(BUILT))
    assert (found.snr <= 10 * np.log10(energy.max(axis=(1, 2)) / np.median(energy, axis=(1, 2))) + 1e-4).all()
    assert found.snr.min() > 3.0


@pytest.mark.parametrize("method", ["peaks", "cfar"])
def test_a_ball_alone_is_found(store: Path, method: str, tmp_path: Path) -> None:
    found = ss.detect(store, method)
    assert set(found.frame.tolist()) == set(BUILT)
    figures = ss.evaluate(store, found).as_json()
    assert figures["ap_1m"] > 0.99 and figures["errors"]["position"]["median_abs"] < 0.6
    assert figures["errors"]["range"]["mean"] < 0.0, "echoes come from the near side"
    back = detection.read(found.write(tmp_path / "d.json"))
    for name in ("frame", "score", "box", "azimuth", "range", "category", "range_error"):
        np.testing.assert_allclose(getattr(back, name), getattr(found, name), rtol=1e-12, atol=1e-12)


def test_the_commands_go_the_whole_way(
    store: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(store)
    assert run(app, ["detect", "."]) == 0 and store.with_name("s.zarr.peaks.json").is_file()
    file = tmp_path / "found.json"
    assert run(app, ["detect", str(store), "--method", "{kind: peaks, threshold: 6 dB}", "--out", str(file)]) == 0
    assert run(app, ["evaluate", str(store), str(file)]) == 0
    assert "found at 1 false alarm" in capsys.readouterr().out
    assert run(app, ["evaluate", str(store), "--predictions", "truth", "--json"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["ap"] == figures["ap_distance"] == 1.0 and figures["objects"] == 3
    assert list(figures["by_category"]) == ["target"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "is no JSON"),
        ('{"image_id": 2}', "must be a list of detections"),
        ('[{"score": 1, "bbox": [0, 0, 1, 1]}]', "detection 0: image_id must be a finite number"),
        ('[{"image_id": 2, "score": NaN, "bbox": [0, 0, 1, 1]}]', "score must be a finite number"),
        ('[{"image_id": 2.5, "score": 1, "bbox": [0, 0, 1, 1]}]', "image_id must be a whole number"),
        ('[{"image_id": 2, "score": 1, "bbox": [0, 0, 1]}]', "bbox must be [x0, y0, width, height]"),
        ('[{"image_id": 2, "score": 1, "bbox": [0, 0, -1, 1]}]', "must not have a negative width"),
        ('[{"image_id": 2, "score": 1, "range": 10}]', "must have a bbox, or azimuth and elevation"),
        (f'[{{"image_id": 2, "score": {10**30}0, "bbox": [0, 0, 1e308, 1]}}]', "bbox must be a finite number"),
        (f'[{{"image_id": 2, "score": {10**300}, "bbox": [0, 0, 1, 1]}}]', "score must be a finite number"),
        ('[{"image_id": 2, "score": 1, "azimuth": 0, "elevation": 0, "range": -1}]', "range must not be negative"),
        ('[{"image_id": 2, "score": 1, "bbox": [0, 0, 1, 1], "range_error": -1}]', "range_error must not be negative"),
        ('[{"image_id": 2, "score": 1, "azimuth": 0, "elevation": 91}]', "elevation must be within 90 degrees"),
        ('[{"image_id": 2, "score": 1, "score": 2, "bbox": [0, 0, 1, 1]}]', "is no JSON (an object has 'score' twice)"),
        ('[{"image_id": 2, "score": 1, "bbox": [0, 0, 1, 1], "category_id": 2}]', "d.json: detection 0: category_id 2"),
        ('[{"image_id": 99, "score": 1, "bbox": [0, 0, 1, 1]}]', "d.json: detection 0: frame 99 is not in the store"),
        ('[{"image_id": 9, "score": 1, "bbox": [0, 0, 1, 1]}]', "d.json: detection 0: frame 9 was not built"),
    ],
)  # fmt: skip
def test_a_bad_file_gets_one_line(
    store: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, said: str
) -> None:
    (tmp_path / "d.json").write_text(text)
    assert run(app, ["evaluate", str(store), str(tmp_path / "d.json")]) == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["evaluate", "STORE"], "give one file of detections"),
        (["evaluate", "STORE", "nothing.json"], "nothing.json: no such file"),
        (["evaluate", "STORE", "."], ".: is not a file but a folder"),
        (["detect", "STORE", "--split", "test"], "no frame of test has been built"),
        (["evaluate", "STORE", "truth", "--split", "exam"], "must be one of train, validation, test, not exam"),
        (["detect", "STORE", "--method", "guess"], "must be one of cfar, peaks, not 'guess'"),
        (["detect", "STORE", "--method", "{kind: peaks, treshold: 3}"], "did you mean 'threshold'?"),
    ],
)
def test_bad_words_get_one_line(store: Path, capsys: pytest.CaptureFixture[str], words: list[str], said: str) -> None:
    assert run(app, [str(store) if word == "STORE" else word for word in words]) == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1
