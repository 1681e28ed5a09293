"""How the amplitude of a wavefront varies over the aperture: what its polynomial adds to the nodes that a tile needs.

A lobe that is broad beside the array is nearly constant over it; a narrow one is a cubic of its own on every path.
"""

from __future__ import annotations

from functools import lru_cache
from math import prod

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.products.array_expansion import aperture_terms
from sonarsynth.receiver import Elements
from sonarsynth.signals.array_paths import Wavefronts
from sonarsynth.signals.gridded.interpolation import box_nodes
from sonarsynth.signals.gridded.nodes import DEGREES, analysis


@lru_cache(maxsize=16)
def _basis(elements: Elements, aperture: float, terms: int) -> tuple[tuple[int, int, int], Floats]:
    """Degrees + 1 (xyz); and in one matrix (row, term) of aperture terms what makes a vector of them as long as their
    root mean square over the hydrophones, and then Chebyshev coefficients over the box, a row each."""
    x, y, z = (DEGREES if s > 0 else 1 for s in np.ptp(elements.position, axis=0))
    value = aperture_terms(box_nodes(elements, (x, y, z)), aperture, terms).reshape(x, y, z, -1)
    for axis, n in enumerate((x, y, z)):
        value = np.moveaxis(np.tensordot(analysis(n), value, (1, axis)), 0, axis)
    triangle = np.linalg.qr(aperture_terms(elements.position, aperture, terms), mode="r") / np.sqrt(elements.count)
    return (x, y, z), np.concatenate([triangle, value.reshape(x * y * z, -1)])


def variation(front: Wavefronts, elements: Elements) -> Floats:
    """Amplitudes of paths over the box round the hydrophones (1 + 3 axes * 4 degrees, path), over the loudest.

    First the root mean square over the hydrophones; then, of each axis, bounds on the Chebyshev coefficients of degree
    0 to 3. No rows where the amplitude is that of the sphere alone.
    """
    if not front.expansion.amplitude.shape[1]:
        return np.zeros((0, front.count))
    from sonarsynth.signals.gridded.tile_kernels import add_degrees

    shape, basis = _basis(elements, front.expansion.aperture, front.expansion.amplitude.shape[1])
    size = basis @ front.expansion.amplitude.T
    size += basis[:, :1]
    root, size = np.split(size, [len(size) - prod(shape)])
    rows = np.zeros((1 + 3 * DEGREES, front.count))
    rows[0] = np.sqrt(np.einsum("tp,tp->p", root, root))
    add_degrees(size, shape, rows[1:].reshape(3, DEGREES, front.count))
    rows *= np.abs(front.amplitude) / np.abs(front.amplitude).max()
    return rows


def degrees(rows: Floats, paths: Ints) -> tuple[tuple[float, ...], ...]:
    """Sizes of the degrees of each axis (xyz, degree) in the sum of some paths, over that sum, from rows of
    `variation`.

    Paths in phase add up by amplitude, others by power: the larger of both is taken. Infinite where nothing is heard.
    """
    if not rows.shape[0]:
        return ((1.0,),) * 3
    from sonarsynth.signals.gridded.tile_kernels import sums

    total, power = sums(rows, paths)
    if not power[0] > 0.0:
        return ((np.inf,),) * 3
    sizes = np.maximum(total[1:] / total[0], np.sqrt(power[1:] / power[0]))
    return tuple(map(tuple, sizes.reshape(3, DEGREES).tolist()))
