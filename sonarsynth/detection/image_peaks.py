"""A threshold: the bright spots of the image."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Gt

from sonarsynth.conventions import Decibels
from sonarsynth.description import description
from sonarsynth.detection.detection_method import Region
from sonarsynth.detection.sonar_view import SonarView


@description
class ImagePeaks:
    """Beams brighter than all others within a beam width, with the beams about each that are nearly as bright.

    The score is the level of the peak over the median of the image (dB), of the beams that hold anything.
    """

    kind: Literal["peaks"] = "peaks"
    threshold: Annotated[Decibels, Gt(0)] = 3.0
    """Peaks stand out of the median by so much."""
    dynamic_range: Annotated[Decibels, Gt(0)] = 13.0
    """Peaks fainter than the brightest by more are side lobes: -13 dB are those of an aperture without weights."""
    extent: Annotated[Decibels, Ge(0)] = 3.0
    """An object is the beams about a peak that are fainter than it by no more."""

    def regions(self, view: SonarView) -> list[Region]:
        """As `DetectionMethod.regions`."""
        from scipy.ndimage import label, maximum_filter

        finite = np.isfinite(view.energy)
        middle = float(np.median(view.energy[finite])) if finite.any() else 0.0
        if not middle > 0.0:
            return []
        energy = np.where(finite, view.energy, 0.0)
        level = 10.0 * np.log10(np.maximum(energy, np.finfo(float).tiny) / middle)
        highest = maximum_filter(level, [2 * reach + 1 for reach in view.reach], mode="nearest")
        least = max(self.threshold, float(level.max()) - self.dynamic_range)
        rows, columns = np.nonzero((level == highest) & (level >= least))
        regions, taken = [], np.zeros(level.shape, bool)
        for n in np.argsort(-level[rows, columns], kind="stable"):
            peak = rows[n], columns[n]
            if taken[peak]:  # on the flank of a brighter one
                continue
            labels, _ = label(level >= level[peak] - self.extent)
            own = (labels == labels[peak]) & ~taken
            taken |= own
            own_rows, own_columns = np.nonzero(own)
            regions.append(Region(own_rows, own_columns, float(level[peak])))
        return regions
