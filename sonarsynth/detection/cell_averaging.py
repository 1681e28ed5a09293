"""Constant false alarm rate: beams that stand out of those around them."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Gt, Lt

from sonarsynth.conventions import Floats, Number
from sonarsynth.description import description
from sonarsynth.detection.detection_method import Region
from sonarsynth.detection.sonar_view import SonarView


@description
class CellAveraging:
    """Cell-averaging CFAR: a beam is of an object where its energy is more than alpha times the mean of the N beams of
    a rectangular ring about it, alpha = N (P^(-1/N) - 1).

    Objects are the connected beams; the score is the largest ratio (dB).

    P is the false alarm rate of energies that are exponential and independent from beam to beam; those of beams that
    overlap, over a window longer than a pulse, are neither, so that it is a knob and no promise. Source: Finn and
    Johnson (1968), RCA Review 29, 414; Richards (2014), Fundamentals of Radar Signal Processing, section 6.5.
    """

    kind: Literal["cfar"] = "cfar"
    false_alarm_rate: Annotated[Number, Gt(0), Lt(1)] = 0.3
    """P."""
    guard: Annotated[Number, Ge(0)] = 0.7
    """Beam widths about a beam that are not averaged: its own echo is there."""
    training: Annotated[Number, Gt(0)] = 1.0
    """Beam widths beyond these that are."""

    def regions(self, view: SonarView) -> list[Region]:
        """As `DetectionMethod.regions`."""
        from scipy.ndimage import find_objects, label

        inner = [round(self.guard * reach) for reach in view.reach]
        outer = [hole + max(1, round(self.training * reach)) for hole, reach in zip(inner, view.reach, strict=True)]
        finite = np.isfinite(view.energy)
        energy = np.where(finite, view.energy, 0.0)
        count = _sum_about(finite.astype(float), outer) - _sum_about(finite.astype(float), inner)
        mean = (_sum_about(energy, outer) - _sum_about(energy, inner)) / np.maximum(count, 1.0)
        ratio = np.divide(energy, mean, out=np.zeros_like(energy), where=(mean > 0.0) & (count > 0.0))
        cells = np.maximum(count, 1.0)
        over = ratio > cells * (self.false_alarm_rate ** (-1.0 / cells) - 1.0)
        labels, _ = label(over, np.ones((3, 3), int))
        regions = []
        for number, box in enumerate(find_objects(labels), 1):
            rows, columns = np.nonzero(labels[box] == number)
            rows, columns = rows + box[0].start, columns + box[1].start
            regions.append(Region(rows, columns, float(10.0 * np.log10(ratio[rows, columns].max()))))
        return regions


def _sum_about(values: Floats, reaches: list[int]) -> Floats:
    """Sums over rectangles of so many beams to each side along each axis, cut at the edges of the image."""
    for axis, reach in enumerate(reaches):
        count = values.shape[axis]
        total = np.concatenate([np.zeros_like(values.take([0], axis)), np.cumsum(values, axis)], axis)
        at = np.arange(count)
        values = total.take(np.minimum(at + reach + 1, count), axis) - total.take(np.maximum(at - reach, 0), axis)
    return values
