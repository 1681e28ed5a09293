"""Every legal spelling of a mesh file gives the body that it says: corners, volume and area exact, by hand."""

import struct
from pathlib import Path

import numpy as np
import pytest

from sonarsynth.geometry.surfaces import MeshError, volume
from sonarsynth.targets.mesh_readers.mesh_files import read_surface
from sonarsynth.targets.mesh_readers.polygons import PolygonError, triangles

CORNERS = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0), (0, 0, 1), (2, 0, 1), (2, 1, 1), (0, 1, 1)]
QUADS = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (3, 7, 6, 2), (0, 4, 7, 3), (1, 2, 6, 5)]
HALVES = [t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))]
MIXED = [*QUADS[:3], *HALVES[6:]]
V = "".join("v {} {} {}\n".format(*v) for v in CORNERS)
F = "".join(f"f {' '.join(str(c + 1) for c in q)}\n" for q in QUADS)
BACK = "".join(f"f {' '.join(str(c - 8) for c in q)}\n" for q in QUADS)
BOX = V + F
ROWS = "".join("{} {} {}\n".format(*v) for v in CORNERS)
FACES = "".join("4 {} {} {} {}\n".format(*q) for q in QUADS)

OBJ = {
    "plain": BOX,
    "byte-order mark": "\ufeff" + BOX,
    "tabs": BOX.replace(" ", "\t"),
    "indented": "".join(f"  {line}\n" for line in BOX.splitlines()),
    "comments after facets": F.replace("\n", " # side 1\n").join([V, ""]),
    "a comment that ends in a backslash": "# from C:\\meshes\\\n" + V + "# D:\\\n" + F,
    "CRLF": BOX.replace("\n", "\r\n"),
    "CR": BOX.replace("\n", "\r"),
    "CRLF and continued lines": BOX.replace("f 1 4 ", "f 1 4 \\\n").replace("\n", "\r\n"),
    "continued between words": BOX.replace("f 1 4 ", "f \\\n1 \\\n4\\\n "),
    "no line end at the end": BOX.rstrip(),
    "facets first": F + V,
    "relative": V + BACK,
    "textures and normals": "vt 0 0\nvn 0 0 1\n" + V + F.replace("f 1 4 3 2", "f 1/1/1 4//1 3/1 2"),
    "colours and weights": V.replace("v 0 0 0", "v 0 0 0 1.0").replace("v 2 0 0", "v 2 0 0 0.5 0.5 0.5") + F,
    "groups, objects, materials": "mtllib x.mtl\no a\n" + V + F.replace("f 5", "g x\nusemtl m\ns 1\nf 5", 1) + "o b\n",
    "the old word for a facet": BOX.replace("f 1", "fo 1"),
}  # fmt: skip

OFF = {
    "plain": f"OFF\n8 6 12\n{ROWS}{FACES}",
    "white space": f"\n \t OFF  \n\n 8\t 6   0 \n{ROWS}\n\n{FACES}\n \n".replace(" ", "  "),
    "counts beside the word": f"OFF 8 6 0\n{ROWS}{FACES}",
    "byte-order mark, CRLF": f"\ufeffOFF\n8 6 0\n{ROWS}{FACES}".replace("\n", "\r\n"),
    "CR": f"OFF\n8 6 0\n{ROWS}{FACES}".replace("\n", "\r"),
    "comments": f"OFF # box\n# by hand\n8 6 0 # counts\n{ROWS}# sides\n{FACES}",
    "colours": "COFF\n8 6 0\n" + ROWS.replace("\n", " 1 0 0 1\n") + FACES.replace("\n", " 0.5 0.5 0.5\n"),
    "all in a row": f"OFF 8 6 0 {ROWS}{FACES}".replace("\n", " "),
    "a coordinate a line": f"OFF\n8 6 0\n{ROWS.replace(' ', chr(10))}{FACES}",
    "two vertices a line": "OFF\n8 6 0\n" + "".join(
        line + (" " if n % 2 == 0 else "\n") for n, line in enumerate(ROWS.splitlines())) + FACES,
    "no count of edges": f"OFF\n8 6\n{ROWS}{FACES}",
}  # fmt: skip


def text_stl(facets=HALVES, name="box"):
    corners = ["\n".join("vertex {} {} {}".format(*CORNERS[c]) for c in f) for f in facets]
    body = "".join(f"facet normal 0 0 0\nouter loop\n{c}\nendloop\nendfacet\n" for c in corners)
    return f"solid {name}\n{body}endsolid {name}\n"


STL = {
    "plain": text_stl(),
    "capitals, indented": "".join(f"\t {line}\n" for line in text_stl().upper().splitlines()),
    "byte-order mark, CRLF": "\ufeff" + text_stl().replace("\n", "\r\n"),
    "CR": text_stl().replace("\n", "\r"),
    "names of words": text_stl(name="solid vertex of a facet, endsolid"),
    "two solids": text_stl(HALVES[:5], "vertex 1") + text_stl(HALVES[5:], "solid"),
    "facets in one line": "solid box\n" + " ".join(text_stl().split()[2:-2]) + "\nendsolid",
}  # fmt: skip


def read(path: Path, data: str | bytes):
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return read_surface(path)


def is_the_box(surface):
    vertices, faces = surface
    corners = {tuple(v) for v in vertices[np.unique(faces)]}
    return corners == set(CORNERS) and len(faces) == 12 and volume(surface) == 2.0 and area(surface) == 10.0


def area(surface):
    a, b, c = np.moveaxis(surface[0][surface[1]], 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


@pytest.mark.parametrize(
    ("ending", "dialect", "text"),
    [(e, n, t) for e, some in {"obj": OBJ, "off": OFF, "stl": STL}.items() for n, t in some.items()],
    ids=lambda value: value if len(value) < 40 else "",
)
def test_every_spelling_of_a_text_gives_the_same_box(tmp_path, ending, dialect, text):
    assert is_the_box(read(tmp_path / f"box.{ending}", text)), dialect


def test_relative_indices_count_from_where_they_stand(tmp_path):
    """Two tetrahedra, each with its vertices before its facets; trimesh put both where the second is."""
    first = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
    second = "v 5 0 0\nv 7 0 0\nv 5 1 0\nv 5 0 3\n"
    sides = "f -4 -2 -3\nf -4 -3 -1\nf -4 -1 -2\nf -3 -2 -1\n"
    surface = read(tmp_path / "two.obj", first + sides + second + sides)
    np.testing.assert_array_equal(surface[1][4:], surface[1][:4] + 4)
    np.testing.assert_array_equal(surface[0][[0, 7]], [[0, 0, 0], [5, 0, 3]])
    assert volume(surface) == pytest.approx(1 / 6 + 1.0, abs=1e-15)


HEAD = """ply{info}
format {kind} 1.0
comment big endian ascii end_header
obj_info element vertex 3
element camera 1
property float focus
element vertex 8
property {real} z
property uchar red
property {real} y
property {real} x
element face {faces}
property int flags
property list uchar {whole} vertex_index
property uchar red
end_header
"""


def ply(kind, facets, real="float", whole="int", info=""):
    """The box with much beside it: elements, properties in another order, comments of telling words."""
    head = HEAD.format(kind=kind, faces=len(facets), real=real, whole=whole, info=info)
    if kind == "ascii":
        rows = [*(f"{z} 7 {y} {x}" for x, y, z in CORNERS), *(f"9 {len(f)} {' '.join(map(str, f))} 8" for f in facets)]
        return (head + "\n".join(["35", *rows, ""])).encode()
    order, f, i = ">" if "big" in kind else "<", "d" if real == "double" else "f", "I" if whole == "uint32" else "i"
    vertices = b"".join(struct.pack(f"{order}{f}B2{f}", z, 7, y, x) for x, y, z in CORNERS)
    faces = b"".join(struct.pack(f"{order}iB{len(c)}{i}B", 9, len(c), *c, 8) for c in facets)
    return head.encode() + struct.pack(f"{order}f", 35) + vertices + faces


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("facets", [HALVES, QUADS, MIXED], ids=["triangles", "quads", "mixed"])
@pytest.mark.parametrize("types", [{}, {"real": "double", "whole": "uint32", "info": "\ncomment first"}])
def test_every_kind_of_ply_gives_the_same_box(tmp_path, kind, facets, types):
    assert is_the_box(read(tmp_path / "box.ply", ply(kind, facets, **types)))


def test_facets_of_a_binary_ply_need_not_have_the_corners_of_the_first(tmp_path):
    """4, 3 and 5 corners take as many bytes as 4, 4 and 4."""
    places = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (1, 3, 0), (0, 2, 0), (-1, 0, 0), (0, -2, 0), (2, -2, 0)]
    head = "ply\nformat binary_little_endian 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
    head += "property float z\nelement face 3\nproperty list uchar int vertex_indices\nend_header\n"
    facets = [(6, 7, 1, 0), (5, 0, 4), (0, 1, 2, 3, 4)]
    body = b"".join(struct.pack("<3f", *p) for p in places)
    body += b"".join(struct.pack(f"<B{len(f)}i", len(f), *f) for f in facets)
    surface = read(tmp_path / "house.ply", head.encode() + body)
    assert len(surface[1]) == 2 + 1 + 3
    assert area(surface) == 4.0 + 1.0 + 5.0


L = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0), (1, 2, 0), (0, 2, 0)]  # concave at the fourth
ARROW = [(0, 0, 0), (2, 1, 0), (0, 2, 0), (1, 1, 0)]
SPLIT_SIDE = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]  # a corner in the middle of a side


@pytest.mark.parametrize(("border", "size"), [(L, 3.0), (ARROW, 1.0), (SPLIT_SIDE, 4.0)])
@pytest.mark.parametrize("turn", [0, 1, 2, 3, 4, 5])
@pytest.mark.parametrize("way", [1, -1])
def test_a_polygon_is_covered_once_whatever_corner_comes_first(border, size, turn, way):
    """No triangle outside, none without area, none turned; and in a plane that is not level."""
    corners = np.roll(np.arange(len(border)), turn)[::way]
    slope = np.array([[1, 0, 0.5], [0, 1, 0.25], [0, 0, 1]])
    vertices = np.array(border, float) @ slope
    faces = triangles(vertices, np.array([len(border)]), corners)
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    level = np.cross(b - a, c - a)[:, 2] / 2 * way  # signed areas as seen from above
    assert len(faces) == len(border) - 2
    assert level.min() > 0.1
    assert level.sum() == pytest.approx(size, abs=1e-12)


def test_star_shaped_polygons_of_many_corners_keep_their_area():
    random = np.random.default_rng(4)
    for count in (5, 8, 13, 40):
        angle = (np.arange(count) + 0.8 * random.random(count)) * 2 * np.pi / count
        radius = 1 + 3 * random.random(count)
        places = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle], axis=-1)
        faces = triangles(places, np.array([count]), np.arange(count))
        x, y = places[:, 0], places[:, 1]
        shoelace = (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2
        a, b, c = np.moveaxis(places[faces], 1, 0)
        level = np.cross(b - a, c - a)[:, 2] / 2
        assert level.min() >= -1e-12
        assert level.sum() == pytest.approx(shoelace, rel=1e-12)


@pytest.mark.parametrize(
    "border",
    [
        [(0, 0, 0), (2, 2, 0), (2, 0, 0), (0, 1, 0)],
        [(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1, 0)],
        [(np.cos(4 * np.pi * n / 5), np.sin(4 * np.pi * n / 5), 0) for n in range(5)],
    ],
    ids=["bow tie", "bow tie of equal halves", "pentagram"],
)
def test_a_polygon_that_crosses_itself_is_refused(border):
    with pytest.raises(PolygonError, match="crosses itself"):
        triangles(np.array(border, float), np.array([len(border)]), np.arange(len(border)))


REFUSED = {
    "more.off": (f"OFF\n8 6 0\n{ROWS}{FACES}{FACES}", "holds more than it says"),
    "flat.off": ("4OFF\n", "of four dimensions"),
    "fewer.off": (f"OFF\n8 6 0\n{ROWS}{FACES[:30]}", "is cut off"),
    "quad.stl": (text_stl([(0, 3, 2, 1)] * 3), "facet 0 is not"),
    "comma.stl": (text_stl().replace("vertex 2 1 1", "vertex 2 1,0 1", 1), "cannot be read as STL"),
    "words.stl": (text_stl().replace("endfacet", "endfacet colour", 1), "facet 1 is not"),
    "line.stl": (text_stl().replace("\n", " ") + "\n", "facets in the line of a 'solid'"),
    "patch.obj": (BOX + "surf 0 1 0 1 1 2 3 4\n", "line 15: a curved surface"),
    "other.obj": (BOX + "call more.obj\n", "line 15: another file is named"),
    "large.obj": (BOX.replace("f 1", "F 1"), "line 9: 'F' is no statement"),
    "under.obj": (BOX.replace("v 2 0 0", "v 2_0 0 0"), "line 2: a vertex whose coordinates are not numbers"),
    "bow.obj": (V + "f 1 3 2 4\n", "line 9: a polygon that crosses itself"),
    "strips.ply": (
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
        "element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n3 0 0 0\n",
        "strips of triangles",
    ),
    "more.ply": (ply("ascii", QUADS) + b"1 2\n", "holds 2 numbers more than its header says"),
    "more_bytes.ply": (ply("binary_big_endian", QUADS) + b"\0", "holds 1 bytes more than its header says"),
    "unknown.ply": (ply("ascii", QUADS).replace(b"uchar", b"byte"), "a line in its header that no PLY has"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_read_right_is_refused(tmp_path, name):
    data, message = REFUSED[name]
    with pytest.raises(MeshError, match=message):
        read(tmp_path / name, data)
