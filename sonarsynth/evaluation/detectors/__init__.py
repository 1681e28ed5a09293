"""Detections judged by the truth of a store."""

from __future__ import annotations

from sonarsynth.evaluation.detectors.detector_scores import TRUTH, DetectorReport, evaluate
from sonarsynth.evaluation.detectors.true_objects import TrueObjects, as_detections, true_objects

__all__ = ["TRUTH", "DetectorReport", "TrueObjects", "as_detections", "evaluate", "true_objects"]
