"""Figures of merit: cases in closed form, laws, and COCO's own evaluation as it is written elsewhere."""

from __future__ import annotations

import contextlib
import io
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sonarsynth.conventions import binomial_band
from sonarsynth.detection import Detections, from_rows
from sonarsynth.evaluation.detectors import DetectorReport, TrueObjects, as_detections
from sonarsynth.evaluation.detectors.detector_scores import OVERLAPS
from sonarsynth.evaluation.detectors.matching import average_precision, threshold_at


def objects(frame: Any, box: Any, category: Any = 0, **more: Any) -> TrueObjects:
    """Objects straight ahead, 10 m away, but for what is said."""
    count = len(frame)
    columns = {name: np.zeros(count) for name in ("azimuth", "elevation", "aspect", "visible", "snr")}
    return TrueObjects(
        frame=np.array(frame),
        category=np.broadcast_to(np.array(category), count).copy(),
        target=np.zeros(count, int),
        box=np.array(box, float).reshape(-1, 4),
        **(columns | {"range": np.full(count, 10.0)} | more),
    )


def report(found: Detections, truth: TrueObjects, frames: int = 10) -> DetectorReport:
    found = replace(found, azimuth=np.nan_to_num(found.azimuth), elevation=np.nan_to_num(found.elevation))
    return DetectorReport(frames, ("a", "b", "c"), found, truth)


def figures(found: Detections, truth: TrueObjects, frames: int = 10) -> dict[str, Any]:
    return report(found, truth, frames).as_json()


UNIT = (0.0, 0.0, 10.0, 10.0)


def test_of_two_objects_the_surest_detection_is_false_and_the_next_two_are_right() -> None:
    """Precision is 1/2 at recall 1/2 and 2/3 at recall 1, so 2/3 at all recalls."""
    truth = objects([0, 1], [UNIT, UNIT])
    rows = [(2, 3.0), (0, 2.0), (1, 1.0)]
    found = from_rows({"frame": frame, "score": score, "box": UNIT} for frame, score in rows)
    assert figures(found, truth)["ap"] == pytest.approx(2.0 / 3.0, abs=1e-12)


def test_of_two_objects_one_is_found_and_the_other_missed() -> None:
    """Precision is 1 at the 51 recalls from 0 to 0.5, and 0 at the 50 beyond."""
    found = from_rows([{"frame": 0, "score": 1.0, "box": UNIT}])
    assert figures(found, objects([0, 1], [UNIT, UNIT]))["ap50"] == pytest.approx(51.0 / 101.0, abs=1e-12)


def test_a_box_of_three_quarters_counts_where_as_much_overlap_is_asked() -> None:
    """Its overlap is 0.75 exactly: right at 0.5, 0.55 ... 0.75, wrong at the four limits above; a second detection of
    the same object is false, but less sure, so that it costs nothing."""
    found = from_rows({"frame": 0, "score": score, "box": (0.0, 0.0, 10.0, 7.5)} for score in (2.0, 1.0))
    of = figures(found, objects([0], [UNIT]))
    assert of["ap"] == pytest.approx(0.6, abs=1e-12)
    assert of["ap50"] == of["ap75"] == 1.0


def test_a_middle_that_is_off_by_a_metre_counts_at_one_metre_and_beyond() -> None:
    found = from_rows([{"frame": 0, "score": 1.0, "azimuth": 0.0, "elevation": 0.0, "range": 11.0, "range_error": 0.5}])
    of = figures(found, objects([0], [UNIT]))
    assert [of[f"ap_{limit}m"] for limit in (0.5, 1, 2, 4)] == [0.0, 1.0, 1.0, 1.0]
    assert np.isnan(of["ap"]), "it has no box"
    assert of["errors"]["range"]["mean"] == of["errors"]["position"]["rms"] == 1.0
    assert of["errors"]["range"]["share_within_1"] == 0.0 and of["errors"]["range"]["share_within_3"] == 1.0
    round_the_back = from_rows([{"frame": 0, "score": 1.0, "azimuth": 359.0, "elevation": 0.0}])
    assert figures(round_the_back, objects([0], [UNIT]))["errors"]["azimuth"]["mean"] == -1.0
    across = from_rows([{"frame": 0, "score": 1.0, "azimuth": np.rad2deg(0.1), "elevation": 0.0}])
    of = figures(across, objects([0], [UNIT]))
    assert of["ap_0.5m"] == 0.0 and of["ap_1m"] == 1.0, "2 sin(0.05) 10 m = 0.9996 m at the range of the object"


def test_detections_at_a_rate_of_false_alarms_with_a_band() -> None:
    """Ten objects in ten frames, a false detection in each of five: the score falls by one a row."""
    truth = objects(range(10), [UNIT] * 10)
    rows = [(frame, 100.0 - 2 * frame, 0.0) for frame in range(10)] + [(n, 95.0 - 2 * n, 20.0) for n in range(5)]
    found = from_rows({"frame": f, "score": s, "azimuth": a, "elevation": 0.0} for f, s, a in rows)
    of = {rate["false_alarms_a_frame"]: rate for rate in figures(found, truth)["detection"]}
    assert of[0.01]["detected"] == 0.3  # of scores 100, 98, 96: before the first false alarm, of 95
    assert of[0.1]["detected"] == 0.4
    assert of[1.0]["detected"] == 1.0
    assert of[0.1]["low"] < 0.4 < of[0.1]["high"]


def test_the_band_holds_the_truth_as_often_as_it_says() -> None:
    """Over all outcomes of a binomial distribution, weighted by their probability."""
    from scipy.stats import binom

    for trials, p in ((20, 0.3), (50, 0.5), (200, 0.9)):
        outcomes = np.arange(trials + 1)
        inside = [low <= p <= high for low, high in (binomial_band(int(n), trials) for n in outcomes)]
        assert 0.92 < binom.pmf(outcomes, trials, p)[inside].sum() < 0.98
    for trials in range(1, 40):  # exactly, also where all or none are hits
        bands = [(binomial_band(hits, trials), hits / trials) for hits in range(trials + 1)]
        assert all(low <= share <= high for (low, high), share in bands)


def test_only_the_order_of_scores_counts_and_no_order_of_rows() -> None:
    random = np.random.default_rng(1)
    score, hit = random.normal(size=200), random.random(200) < 0.4
    plain = average_precision(score, hit, 150)
    order = random.permutation(200)
    assert average_precision(np.exp(score), hit, 150) == plain
    assert average_precision(score[order], hit[order], 150) == plain
    assert threshold_at(score, hit, np.inf if hit.all() else 1e9) == -np.inf


def test_what_one_condition_finds_is_no_matter_of_another() -> None:
    """An object that is found at 20 m, one that is missed at 40 m."""
    truth = objects([0, 1], [UNIT, UNIT], range=np.array([20.5, 40.0]))
    of = figures(from_rows([{"frame": 0, "score": 1.0, "box": UNIT}]), truth)["by_range"]
    assert of["20 to 30 m"]["ap50"] == 1.0 and of["30 to 50 m"]["ap50"] == 0.0
    assert of["20 to 30 m"]["detected"] == 1.0 and of["30 to 50 m"]["detected"] == 0.0


def drawn(seed: int) -> tuple[Detections, TrueObjects]:
    """Objects of three categories in 30 frames, and detections about most of them and elsewhere."""
    random = np.random.default_rng(seed)
    frame = random.integers(0, 30, 120)
    corner, size = random.uniform(0, 60, (120, 2)), random.uniform(3, 20, (120, 2))
    truth = objects(frame, np.concatenate([corner, corner + size], axis=1), random.integers(0, 3, 120))
    some = random.random(120) < 0.8
    box = truth.box[some] + random.normal(0, 1.0, (int(some.sum()), 4))
    box[:, 2:] = np.maximum(box[:, 2:], box[:, :2] + 0.5)
    false = np.column_stack([*(corner[:40].T + 9), *(corner[:40].T + 20)])
    said = np.where(random.random(some.sum()) < 0.9, truth.category[some], 0)
    rows = zip(
        np.concatenate([frame[some], random.integers(0, 30, 40)]).tolist(),
        np.concatenate([said, random.integers(0, 3, 40)]).tolist(),
        np.concatenate([box, false]).tolist(),
        random.permutation(int(some.sum()) + 40).astype(float).tolist(),
        strict=True,
    )
    return from_rows({"frame": f, "category": c, "box": b, "score": s} for f, c, b, s in rows), truth


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_it_is_what_coco_says(seed: int) -> None:
    from faster_coco_eval import COCO, COCOeval_faster

    found, truth = drawn(seed)
    boxes = np.column_stack([truth.box[:, :2], truth.box[:, 2:] - truth.box[:, :2]])
    annotations = [
        {"id": n + 1, "image_id": int(f), "category_id": int(c) + 1, "bbox": b.tolist(), "area": float(b[2] * b[3]),
         "iscrowd": 0}
        for n, (f, c, b) in enumerate(zip(truth.frame, truth.category, boxes, strict=True))
    ]  # fmt: skip
    results = [
        {"image_id": int(f), "category_id": int(c) + 1, "bbox": [*b[:2], *(b[2:] - b[:2])], "score": float(s)}
        for f, c, b, s in zip(found.frame, found.category, found.box, found.score, strict=True)
    ]
    images = [{"id": n, "width": 100, "height": 100} for n in range(30)]
    categories = [{"id": n + 1, "name": str(n)} for n in range(3)]
    with contextlib.redirect_stdout(io.StringIO()):
        coco = COCO({"images": images, "annotations": annotations, "categories": categories})
        judge = COCOeval_faster(coco, coco.loadRes(results), "bbox")
        judge.params.iouThrs = np.array(OVERLAPS)
        judge.evaluate()
        judge.accumulate()
        judge.summarize()
    of = figures(found, truth)
    assert [of["ap"], of["ap50"], of["ap75"]] == pytest.approx(list(judge.stats[:3]), abs=1e-6)
    assert 0.1 < of["ap"] < 0.9


def test_the_truth_judged_by_itself_is_perfect() -> None:
    _, truth = drawn(4)
    of = figures(as_detections(truth), truth)
    assert of["ap"] == of["ap_distance"] == 1.0
    assert all(rate["detected"] == 1.0 for rate in of["detection"])
    assert of["errors"]["position"]["rms"] == pytest.approx(0.0, abs=1e-12)
