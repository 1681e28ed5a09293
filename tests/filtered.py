"""The filtered snap by quadrature of its convolution."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.bubble import snap_pressure
from sonarsynth.equations.bubble.snap_pressure import Bubble
from sonarsynth.equations.noise.filters import Fir, duration, impulse_response


def filtered_pulse(time: Floats, bubble: Bubble, fir: Fir) -> Floats:
    """Pressure (Pa) of the filtered snap at 1 m at times (s) after the collapse: int p(t - s) h(s) ds, to 1e-9 of its
    peak."""
    t = np.asarray(time, float)
    node, weight = np.polynomial.legendre.leggauss(24)
    x, _ = snap_pressure.quadrature(bubble, 2.0 * fir.high)
    corners = np.concatenate([[0.0], x[23::24] + (x[24] - x[23])])  # close to the panels of the snap: graded alike
    half = 0.5 * duration(fir)
    out = np.zeros(t.size)
    for i, now in enumerate(t.ravel()):
        low, high = max(0.0, -half - now), min(half - now, corners[-1])  # h(now + x) is not zero for these x
        if high <= low:
            continue
        edges = np.concatenate([[low], corners[(corners > low) & (corners < high)], [high]])
        middle, radius = 0.5 * (edges[1:] + edges[:-1])[:, None], 0.5 * np.diff(edges)[:, None]
        x = middle + radius * node
        out[i] = float(np.sum(snap_pressure.pressure(-x, bubble) * impulse_response(now + x, fir) * radius * weight))
    return out.reshape(t.shape)
