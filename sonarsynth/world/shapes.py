"""What targets are made of: a mesh file, or a shape that is generated at any resolution. Body frame: x forward, z up."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le

from sonarsynth.conventions import Number, Position, PositiveMetres, Radians
from sonarsynth.description import BY_KIND, description

MAX_FACETS = 20_000_000
"""A mesh of more facets is refused (about 3 GB of arrays)."""


@description
class MeshFile:
    """A mesh in a file: STL, OBJ, PLY, OFF or GLB."""

    kind: Literal["mesh_file"] = "mesh_file"
    path: str
    """Relative to the recipe."""
    unit: Literal["m", "cm", "mm", "in", "ft"] = "m"
    """Unit of the numbers in the file."""
    offset: Position = (0.0, 0.0, 0.0)
    """Shift (m) of the file's origin in the body frame, after the turn."""
    heading: Radians = 0.0
    """Turn about z (counter-clockwise seen from above) that brings the file's forward axis to x."""
    pitch: Radians = 0.0
    """Turn about y, before the heading."""
    roll: Radians = 0.0
    """Turn about x, first."""
    edge: PositiveMetres | None = None
    """Subdivide flat facets until no edge is longer; the surface stays as it is."""


@description
class Sphere:
    """A sphere, refined on the true surface."""

    kind: Literal["sphere"] = "sphere"
    radius: PositiveMetres
    edge: PositiveMetres | None = None
    """Longest edge of a facet; left out: an eighth of the radius."""


@description
class Cylinder:
    """A solid circular cylinder along x, with flat ends."""

    kind: Literal["cylinder"] = "cylinder"
    radius: PositiveMetres
    length: PositiveMetres
    edge: PositiveMetres | None = None


@description
class Box:
    """A box, centred on the origin."""

    kind: Literal["box"] = "box"
    size: tuple[PositiveMetres, PositiveMetres, PositiveMetres]
    edge: PositiveMetres | None = None
    """Left out: two facets a face."""


@description
class LShape:
    """Two plates in the shape of an L seen from the side y: one upright in the plane x = 0, one lying forward of its foot."""

    kind: Literal["l_shape"] = "l_shape"
    height: PositiveMetres
    length: PositiveMetres
    width: PositiveMetres
    thickness: PositiveMetres
    edge: PositiveMetres | None = None


@description
class Remus100:
    """REMUS-100 autonomous underwater vehicle: a Myring hull with four fins, from published dimensions.

    Prestero (2001), "Verification of a six-degree of freedom simulation model for the REMUS autonomous underwater
    vehicle", MIT: Myring parameters and fin geometry.
    """

    kind: Literal["remus100"] = "remus100"
    edge: PositiveMetres | None = 0.014
    """Longest edge of a facet round the girth and along the hull, refined on the true surface."""
    fins: bool = True
    coarse: bool = False
    """The thesis's 286 facets, for comparison; edge is ignored."""


@description
class Myring:
    """A body of revolution along x by Myring (1976): nose of length a, middle of length b, tail of length c, diameter d."""

    kind: Literal["myring"] = "myring"
    nose: PositiveMetres
    middle: PositiveMetres
    tail: PositiveMetres
    diameter: PositiveMetres
    exponent: Annotated[Number, Gt(0), Le(10)] = 2.0
    tail_angle: Annotated[Radians, Ge(0), Le(1.5)] = 0.436
    edge: PositiveMetres | None = None


Shape = Annotated[MeshFile | Sphere | Cylinder | Box | LShape | Remus100 | Myring, BY_KIND]
