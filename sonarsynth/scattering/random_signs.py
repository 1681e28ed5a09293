"""Signs of facets: what makes the echoes of a rough surface add by power."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.description.byte_bounded_cache import byte_bounded_cache
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.randomness import stream


def random_polarity(mesh: Mesh) -> Floats:
    """(facet,) +1 or -1 at random, fixed for each facet of a mesh: the same in every frame and every build.

    The echoes of facets then have no phase in common, so that the expected power of their sum is the sum of their
    powers, whatever the number of facets: incoherent scattering by a rough surface.
    """
    return _signs(mesh.digest, len(mesh.faces))


@byte_bounded_cache(16)
def _signs(digest: str, facets: int) -> Floats:
    signs = stream(0, "polarity", digest).choice([-1.0, 1.0], facets)
    signs.setflags(write=False)
    return np.asarray(signs)
