"""Files that are no mesh: each refused in one line that names the file and the reason, without a hang."""

import numpy as np
import pytest
import trimesh

from sonarsynth.targets.meshes import MeshError, mesh_of
from sonarsynth.targets.shapes import MeshFile, Sphere

PLY = (
    "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
    "element face {}\nproperty list uchar int vertex_indices\nend_header\n"
)
CORNERS = "0 0 0\n1 0 0\n0 1 0\n"
HUGE = 10**12


def stl(count, facets):
    return bytes(80) + count.to_bytes(4, "little") + np.asarray(facets, "<f4").tobytes()


def facet(*corners):
    """The 50 bytes of a facet in a binary STL."""
    return np.array([0, 0, 1, *np.ravel(corners)], "<f4").tobytes() + b"\0\0"


def one(*corners):
    return bytes(80) + (1).to_bytes(4, "little") + facet(*corners)


BROKEN = {
    "empty.stl": (b"", "is empty"),
    "empty.obj": (b"", "is empty"),
    "blank.off": (b"  \n\n", "is empty"),
    "zeros.stl": (bytes(1000), "is no STL file, or damaged: 1000 bytes where its header says 84"),
    "short.stl": (bytes(30), "is no STL file, or cut off"),
    "none.stl": (bytes(84), "holds no facets"),
    "lies.stl": (bytes(80) + b"\xff\xff\xff\xff" + bytes(50), "134 bytes where its header says 214748364834"),
    "long.stl": (one((0, 0, 0), (1, 0, 0), (0, 1, 0)) + b"x", "damaged: 135 bytes where its header says 134"),
    "nan.stl": (one((0, 0, np.nan), (1, 0, 0), (0, 1, 0)), "vertex 0 is not finite"),
    "inf.stl": (one((0, 0, 0), (1, 0, 0), (0, np.inf, 0)), "vertex 2 is not finite"),
    "flat.stl": (one((0, 0, 0), (1, 0, 0), (2, 0, 0)), "no facet has an area"),
    "point.stl": (one((1, 1, 1), (1, 1, 1), (1, 1, 1)), "is 0 m across, smaller than 1 mm; give the `unit`"),
    "large.stl": (one((0, 0, 0), (2e6, 0, 0), (0, 1, 0)), "is 2e.06 m across, larger than 10 km; give the `unit`"),
    "small.stl": (one((0, 0, 0), (2e-4, 0, 0), (0, 1e-4, 0)), "is 0.0002 m across, smaller than 1 mm"),
    "vast.stl": (one((0, 0, 0), (3e38, 0, 0), (0, 3e38, 0)), "larger than 10 km"),
    "cut_text.stl": (b"solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", "the text STL has no 'endsolid'"),
    "no_facets.stl": (b"solid x facet\nendsolid x\n", "(holds no facets|cannot be read as STL)"),
    "index.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99\n", "line 4: index 99 is out of range, there are 3 vertices"),
    "zero.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "line 4: index 0 is out of range"),
    "minus.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -9\n", "line 4: index -9 is out of range"),
    "huge.obj": (
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99999999999999999999\n",
        "line 4: index 99999999999999999999 is out",
    ),
    "corner.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "line 4: a facet with fewer than three corners"),
    "words.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf a b c\n", "line 4: a facet whose corners are not numbers"),
    "plane.obj": (b"v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n", "line 1: a vertex without three coordinates"),
    "number.obj": (b"v 0 0 x\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "line 1: a vertex whose coordinates are not numbers"),
    "nan.obj": (b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "vertex 0 is not finite"),
    "lines.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2\n", "holds no facets"),
    "no.off": (b"FOO\n3 1 0\n", "is no OFF file"),
    "counts.off": (b"OFF\nmany\n", "has no counts of vertices and facets"),
    "index.off": (
        f"OFF\n3 1 0\n{CORNERS}3 0 1 7\n".encode(),
        "facet 0 has index 7, out of range: there are 3 vertices",
    ),
    "huge.off": (
        f"OFF\n3 {HUGE} 0\n{CORNERS}3 0 1 2\n".encode(),
        "is cut off: 4 lines where its header says 1000000000003",
    ),
    "no.ply": (b"plywood\n", "is no PLY file, or cut off in its header"),
    "index.ply": (
        (PLY.format("ascii", 3, 1) + CORNERS + "3 0 1 9\n").encode(),
        "facet 0 has index 9, out of range: there are 3 vertices",
    ),
    "minus.ply": ((PLY.format("ascii", 3, 1) + CORNERS + "3 0 1 -2\n").encode(), "facet 0 has index -2, out of range"),
    "huge.ply": (
        (PLY.format("ascii", HUGE, 1) + CORNERS).encode(),
        "is cut off, or damaged, in its element 'vertex' .3 of 1000000000000 are there",
    ),
    "huge_b.ply": (
        (PLY.format("binary_little_endian", HUGE, HUGE) + "abc").encode(),
        "is cut off, or damaged, in its element 'vertex'",
    ),
    "cloud.ply": ((PLY.format("ascii", 3, 0) + CORNERS).encode(), "holds no facets"),
    "no.glb": (b"glTX" + bytes(40), "is no GLB file"),
    "cut.glb": (
        b"glTF" + (2).to_bytes(4, "little") + (900).to_bytes(4, "little"),
        "is cut off: 12 bytes where its header",
    ),
    "json.glb": (
        b"glTF" + (2).to_bytes(4, "little") + (24).to_bytes(4, "little") + (4).to_bytes(4, "little") + b"JSON{{{{",
        "cannot be read as GLB",
    ),
    "body.step": (b"ISO-10303-21;", "is not one of STL, OBJ, PLY, OFF, GLB"),
    "body": (b"solid", "is not one of STL"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_file_is_refused_in_one_line(tmp_path, name):
    data, message = BROKEN[name]
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(MeshError, match=message) as refused:
        mesh_of(MeshFile(path=str(path)))
    assert "\n" not in str(refused.value)
    assert str(refused.value).startswith(str(path))


def test_a_unit_brings_an_absurd_size_back(tmp_path):
    path = tmp_path / "mm.stl"
    path.write_bytes(one((0, 0, 0), (2e4, 0, 0), (0, 1, 0)))
    assert mesh_of(MeshFile(path=str(path), unit="mm")).box[1, 0] == pytest.approx(20.0)
    guessed = mesh_of(MeshFile(path=str(path)))
    assert guessed.box[1, 0] == pytest.approx(20.0) and "taken to be in mm, 20 m across" in guessed.notes[0]
    assert mesh_of(MeshFile(path=str(path), unit="cm")).box[1, 0] == pytest.approx(200.0)


FORMATS = {
    "stl": {},
    "text.stl": {"file_type": "stl_ascii"},
    "obj": {},
    "ply": {},
    "text.ply": {"file_type": "ply", "encoding": "ascii"},
    "off": {},
    "glb": {},
}


@pytest.mark.parametrize("ending", FORMATS)
def test_a_file_cut_off_anywhere_is_refused_or_whole(tmp_path, ending):
    """An OBJ does not say its length: cut between two lines it is a smaller mesh, then said not to be closed."""
    ball = mesh_of(Sphere(radius=0.5, edge=0.45))
    whole = tmp_path / f"whole.{ending}"
    trimesh.Trimesh(ball.vertices, ball.faces, process=False).export(whole, **FORMATS[ending])
    data = whole.read_bytes()
    assert len(mesh_of(MeshFile(path=str(whole))).faces) == len(ball.faces)
    refused = 0
    cuts = np.random.default_rng(5).integers(0, len(data), 60)
    for cut in [*cuts, 1, 5, 79, 83, 84, 85, len(data) - 2]:
        path = tmp_path / f"cut{cut}.{ending}"
        path.write_bytes(data[:cut])
        try:
            mesh = mesh_of(MeshFile(path=str(path)))
        except MeshError as error:
            refused += 1
            assert "\n" not in str(error) and str(error).startswith(str(path))
        else:
            cut_text = ending == "obj" and any("not closed" in note for note in mesh.notes)
            assert cut_text or len(data) - cut < 30
    assert refused > (20 if ending == "obj" else 60)


@pytest.mark.parametrize("ending", FORMATS)
def test_a_file_with_flipped_bytes_is_refused_or_a_usable_mesh(tmp_path, ending):
    ball = mesh_of(Sphere(radius=0.5, edge=0.45))
    whole = tmp_path / f"whole.{ending}"
    trimesh.Trimesh(ball.vertices, ball.faces, process=False).export(whole, **FORMATS[ending])
    data = np.frombuffer(whole.read_bytes(), np.uint8)
    rng = np.random.default_rng(6)
    for trial in range(40):
        bad = data.copy()
        bad[rng.integers(0, len(data), 5)] = rng.integers(0, 256, 5)
        path = tmp_path / f"bad{trial}.{ending}"
        path.write_bytes(bad.tobytes())
        try:
            mesh = mesh_of(MeshFile(path=str(path)))
        except MeshError as error:
            assert "\n" not in str(error) and str(error).startswith(str(path))
        else:
            assert np.isfinite(mesh.vertices).all() and np.isfinite(mesh.normal).all()
            assert mesh.area.min() > 0 and mesh.faces.min() >= 0 and mesh.faces.max() < len(mesh.vertices)
