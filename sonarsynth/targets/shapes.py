"""What targets are made of: a mesh file, or a shape generated at any resolution. Body frame: x forward, z up."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, ClassVar, Literal

import numpy as np
from annotated_types import Ge, Gt, Le, Lt
from pydantic import ValidationInfo, field_validator

from sonarsynth.conventions import Metres, NonNegativeMetres, Number, Position, PositiveMetres, Radians
from sonarsynth.description import BY_KIND, description
from sonarsynth.description.method import Method

Size = Annotated[PositiveMetres, Ge(1e-9), Le(10e3)]
"""Of a body, or of a part of it."""


class BodyShape(Method):
    """What a target looks like."""

    @property
    def plain(self) -> MeshFile | None:
        """What is read from a file before its facets are cut, to be looked at first; none of what is generated."""
        return None

    @property
    def read_as(self) -> str:
        """How a file is understood, for messages."""
        return ""


@description
class MeshFile(BodyShape):
    """A mesh in a file: STL, OBJ, PLY, OFF, glTF, COLLADA, 3MF, or a text of three lines a facet; or a grid of heights
    (CSV, npz, netCDF): x, y and z (or depth) in metres, whose front is above; or a bottom of Bellhop (BTY)."""

    kind: Literal["mesh_file"] = "mesh_file"
    path: str
    """Path of the file, relative to the recipe."""
    unit: Literal["auto", "m", "cm", "mm", "in", "ft"] = "auto"
    """Unit of the numbers in the file. `auto`: what the file says (COLLADA, glTF, 3MF); else metres, or millimetres
    where it would be larger than 300 m, which a note says. Of a file that says it: of what it calls a metre."""
    sides: Literal["front", "both"] = "front"
    """Which sides of a sheet (a part that is not closed: a fin, a net, a scan) scatter."""
    offset: Position = (0.0, 0.0, 0.0)
    """Shift (m) of the file's origin in the body frame, after the turn."""
    heading: Radians = 0.0
    """Turn about z (counter-clockwise seen from above) that brings the file's forward axis to x."""
    pitch: Radians = 0.0
    """Turn about y, before the heading."""
    roll: Radians = 0.0
    """Turn about x, first."""
    edge: Size | None = None
    """Subdivide facets until no edge is longer; unless smooth, they are cut in their planes, and the surface stays as
    it is. Left out: 10 cm where each facet echoes from its middle (`mirror_lobe`), else as the file has them."""
    smooth: bool = False
    """The file stands for a curved surface: facets that are too long are cut along curves through their corners, with
    smooth normals. For Kirchhoff scattering, too long is what the wavelength says."""
    crease: Annotated[Radians, Gt(0), Lt(np.pi)] = np.deg2rad(40.0)
    """Edges that turn by more stay sharp. Nothing where not smooth."""
    floor: Metres | None = None
    """Height (z in the body frame) of a level ground: what is lower is raised to it, and nothing is left that lies in
    it. Left out: there is none."""
    least: NonNegativeMetres = 0.0
    """What rises less over the floor is taken as the floor."""

    @property
    def plain(self) -> MeshFile:
        """As `BodyShape.plain`."""
        return replace(self, edge=None, smooth=False)

    @property
    def read_as(self) -> str:
        """As `BodyShape.read_as`."""
        return "" if self.unit == "auto" else f"with numbers in {self.unit}"


@description
class Sphere(BodyShape):
    """A sphere, refined on the true surface."""

    kind: Literal["sphere"] = "sphere"
    radius: Size
    """From its centre, which is the origin."""
    edge: Size | None = None
    """Longest edge of a facet; left out: an eighth of the radius, at most 10 cm where each echoes from its middle."""


@description
class Cylinder(BodyShape):
    """A solid circular cylinder along x, with flat ends, centred on the origin; refined on the true surface."""

    kind: Literal["cylinder"] = "cylinder"
    radius: Size
    """Radius of the circle."""
    length: Size
    """Length along x."""
    edge: Size | None = None
    """Longest edge of a facet; left out: an eighth of the radius, at most 10 cm where each echoes from its middle."""


@description
class Box(BodyShape):
    """A box, centred on the origin."""

    kind: Literal["box"] = "box"
    size: tuple[Size, Size, Size]
    """Lengths along x, y and z."""
    edge: Size | None = None
    """Longest edge of a facet; left out: two facets a face, cut to 10 cm where each echoes from its middle."""


@description
class LShape(BodyShape):
    """Two plates, an L seen from the side: one upright in the plane x = 0, one lying forward of its foot.

    The origin is where their inner faces meet, in the middle of the width: a corner that opens forward and up.
    """

    kind: Literal["l_shape"] = "l_shape"
    height: Size
    """Height of the inner face of the upright plate (x = 0, facing forward)."""
    length: Size
    """Length of the inner face of the lying plate (z = 0, facing up)."""
    width: Size
    """Width of both plates, along y."""
    thickness: Size
    """Thickness of both plates, behind and below the inner faces."""
    edge: Size | None = None
    """Longest edge of a facet; left out: the fewest facets, cut to 10 cm where each echoes from its middle."""


@description
class Remus100(BodyShape):
    """REMUS-100 autonomous underwater vehicle: a Myring hull with four fins, from published dimensions.

    Prestero (2001), "Verification of a six-degree of freedom simulation model for the REMUS autonomous underwater
    vehicle", MIT: Myring parameters and fin geometry (`targets.generated.remus`). The origin is the middle of the
    hull's length.
    """

    kind: Literal["remus100"] = "remus100"
    edge: Size = 0.014
    """Longest edge of a facet round the girth and along the hull, refined on the true surface."""
    fins: bool = True
    """With its four fins."""
    coarse: bool = False
    """As few facets as the thesis's model, 286 (238 without fins), for comparison; edge is ignored."""


@description
class Myring(BodyShape):
    """A body of revolution along x by Myring (1976), centred on the origin; refined on the true surface.

    Nose of length a, r = (d/2) (1 - t^2)^(1/exponent) at t a before the middle; middle of length b and diameter d; tail
    of length c, a cubic that ends at the tail angle. Offsets cut off the tips and leave flat ends.
    """

    kind: Literal["myring"] = "myring"
    nose: Size
    """Length of the nose."""
    middle: NonNegativeMetres
    """Length of the straight part."""
    tail: Size
    """Length of the tail."""
    diameter: Size
    """Diameter of the straight part."""
    exponent: Annotated[Number, Ge(0.5), Le(10)] = 2.0
    """Exponent of the nose: 2 is an ellipse, more is blunter."""
    tail_angle: Annotated[Radians, Ge(0), Le(1.5)] = np.float64(0.436)
    """Half the angle included at the tip of the tail."""
    nose_offset: NonNegativeMetres = 0.0
    """Length of the nose that is missing."""
    tail_offset: NonNegativeMetres = 0.0
    """Length of the tail that is missing."""
    edge: Size | None = None
    """Longest edge of a facet; left out: a sixteenth of the diameter, at most 10 cm where it echoes from its middle."""

    @field_validator("tail_angle")
    @classmethod
    def _no_bulge(cls, angle: float, info: ValidationInfo) -> float:
        tail, diameter = info.data.get("tail"), info.data.get("diameter")
        if tail is not None and diameter is not None and np.tan(angle) > 1.5 * diameter / tail:
            top = float(np.arctan(1.5 * diameter / tail))
            raise ValueError(f"would make the tail thicker than the diameter; use {top:.3g} rad at most for this tail")
        return angle

    @field_validator("nose_offset", "tail_offset")
    @classmethod
    def _not_all(cls, offset: float, info: ValidationInfo) -> float:
        size = info.data.get(str(info.field_name).removesuffix("_offset"))
        if size is not None and offset > 0.99 * size:
            raise ValueError(f"leaves nothing of the {size:g} m of the {str(info.field_name).removesuffix('_offset')}")
        return offset


@description
class Knots(BodyShape):
    """Knots of a net in the plane x = 0, in rows and columns centred on the origin; with one column, links of a chain.
    Each is an octahedron: lit and seen from one side it shows four facets."""

    kind: Literal["knots"] = "knots"
    columns: Annotated[int, Ge(1), Le(1000)] = 1
    """Knots in a row, along y."""
    rows: Annotated[int, Ge(1), Le(1000)] = 20
    """Rows of knots, along z."""
    spacing: Size = 0.1
    """Distance from one knot to the next."""
    radius: Size = 0.02
    """From the middle of a knot to its corners."""
    edge: ClassVar[None] = None


@description
class School(BodyShape):
    """Fish, or bubbles: alike octahedra spread evenly in an ellipsoid about the origin. Each shows four facets where it
    is lit and seen from one side, so that by the law `isotropic` it has a target strength of 20 log10 of four times
    the law's strength: a fish of 20 cm has about -40 dB at its side (Love 1977, J. Acoust. Soc. Am. 62, 1397)."""

    kind: Literal["school"] = "school"
    axes: tuple[Size, Size, Size] = (1.0, 1.0, 0.5)
    """Half its length along x, y and z."""
    members: Annotated[int, Ge(1), Le(20_000)] = 200
    """How many there are."""
    radius: Size = 0.05
    """From the middle of one to its corners."""
    arrangement: Annotated[int, Ge(0)] = 0
    """Another number is another arrangement of its members."""
    edge: ClassVar[None] = None


Shape = Annotated[MeshFile | Sphere | Cylinder | Box | LShape | Remus100 | Myring | Knots | School, BY_KIND]
