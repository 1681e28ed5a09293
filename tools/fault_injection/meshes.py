"""Random changes of mesh files, by bytes, by numbers and by what they say of themselves: refused, or a usable mesh."""

from __future__ import annotations

import base64
import io
import json
import struct
import zipfile
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from fault_injection.casts import RECIPE, USUAL
from fault_injection.fuzz import judged
from fault_injection.recipes import Case, by_file, by_structure, damaged, lines_changed, numbers, pick, places

ODD_WORDS = (
    b"\x00\x00\xc0\x7f", b"\x00\x00\x80\x7f", b"\xff\xff\x7f\x7f", b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f",
    b"\x00\x00\x00\x80", b"\x01\x00\x00\x00", b"\x00\x00\x00\x00", b"\x00\x00\x80\x3f", b"\x80\x96\x98\x00",
)  # fmt: skip
"""NaN, infinity, the largest number, -1, the largest index, the smallest, 1, 0, 1.0, 10 000 000."""
ODD_LINES = (
    b"f 1 2 3", b"f 1 1 1", b"f -1 -2 -3", b"f 1 2 3 4 5 6 7 8", b"f 0 0 0", b"f 1/1/1 2//2 3/3", b"v 0 0 0",
    b"v 1e300 0 0", b"v nan nan nan", b"v", b"mtllib ../outside/x.mtl", b"mtllib /dev/zero", b"usemtl x", b"o x",
    b"g x", b"s off", b"l 1 2", b"\\", b"vn 0 0 0", b"vt 0", b"element face 1000000000", b"element vertex 1000000000",
    b"element x 1000000000", b"property list uint double vertex_indices", b"property float x",
    b"comment TextureFile /dev/zero", b"format binary_big_endian 1.0", b"end_header", b"endsolid", b"solid",
    b"facet normal 0 0 1", b"endfacet", b"1000000000 1000000000 0", b"3 0 1 2", b"3 0 0 0", b"9 0 1 2", b"4 0 1 2 3",
    b'<!DOCTYPE x [<!ENTITY a "b">]>', b'<instance_node url="#node0"/>', b'<p>0 1 1000000000</p>', b"<ph>", b"0 0",
    b'<instance_geometry url="file:///etc/passwd#x"/>', b"OFF", b"#", b"\0", b"\xff",
)  # fmt: skip


odd_lines = lines_changed(ODD_LINES)


def run(count: int, seed: int, folder: Path | None = None) -> dict[str, Any]:
    """Judge so many changed mesh files. Returns what came of them."""
    return judged(bases(), mutated, count, seed, folder)


def bases() -> list[Case]:
    """A recipe with a mesh, in every format that is read, binary and text, closed, open and in several parts."""
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.5)
    parts = trimesh.util.concatenate(
        [trimesh.creation.box((0.4, 0.3, 0.2)), trimesh.creation.cone(0.3, 0.6, sections=8)]
    )
    sheet = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    found = []
    for name, mesh, kind, options in (
        ("ball.stl", ball, "stl", {}),
        ("text.stl", parts, "stl_ascii", {}),
        ("ball.obj", ball, "obj", {}),
        ("parts.ply", parts, "ply", {}),
        ("text.ply", ball, "ply", {"encoding": "ascii"}),
        ("parts.off", parts, "off", {}),
        ("ball.glb", ball, "glb", {}),
        ("sheet.obj", sheet, "obj", {}),
        ("parts.dae", parts, "dae", {}),
        ("ball.gltf", ball, "glb", {}),
        ("parts.3mf", parts, "obj", {}),
    ):
        data = mesh.export(file_type=kind, **options)
        data = _gltf(data) if name.endswith("gltf") else _packed(_model(mesh)) if name.endswith("3mf") else data
        data = data.encode() if isinstance(data, str) else bytes(data)
        found.append(_case(name, data, smooth=name.startswith("ball")))
    corners = "".join("{:g} {:g} {:g}\n".format(*corner) for corner in parts.triangles.reshape(-1, 3))
    return [*found, _case("parts.txt", corners.encode(), smooth=False)]


def _case(name: str, data: bytes, *, smooth: bool) -> Case:
    shape = f"{{kind: mesh_file, path: {name}, smooth: {str(smooth).lower()}}}"
    return Case(name, RECIPE.format(**USUAL | {"shape": shape}).encode(), {name: data})


def _gltf(data: bytes) -> bytes:
    """A GLB as a text that holds its buffer."""
    size = struct.unpack("<I", data[12:16])[0]
    tree = json.loads(data[20 : 20 + size])
    tree["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(data[28 + size :]).decode()
    return json.dumps(tree, indent=1).encode()


def _model(mesh: trimesh.Trimesh) -> bytes:
    """The XML of a 3MF, its numbers in metres."""
    space = "http" + "://schemas.microsoft.com/3dmanufacturing/core/2015/02"
    vertices = "".join('<vertex x="{:g}" y="{:g}" z="{:g}"/>\n'.format(*v) for v in mesh.vertices)
    faces = "".join('<triangle v1="{}" v2="{}" v3="{}"/>\n'.format(*f) for f in mesh.faces)
    return (
        f'<model unit="meter" xmlns="{space}"><resources>\n<object id="1"><mesh><vertices>\n{vertices}</vertices>\n'
        f'<triangles>\n{faces}</triangles></mesh></object>\n<object id="2"><components>\n<component objectid="1" '
        'transform="1 0 0 0 1 0 0 0 1 0 0 0"/>\n</components></object></resources>\n<build>\n<item objectid="2"/>\n'
        "</build></model>\n"
    ).encode()


def _packed(model: bytes) -> bytes:
    box = io.BytesIO()
    with zipfile.ZipFile(box, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("3D/3dmodel.model", model)
    return box.getvalue()


def _inside(data: bytes, random: np.random.Generator) -> bytes:
    """What a 3MF packs changed, and packed again."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            model = archive.read(archive.namelist()[0])
    except (
        zipfile.BadZipFile,
        zlib.error,
        OSError,
        RuntimeError,
        NotImplementedError,
        IndexError,
        EOFError,
        ValueError,
    ):
        return damaged(data, random)
    return _packed(pick((numbers, numbers, odd_lines, damaged), random)(model, random))


def mutated(case: Case, random: np.random.Generator) -> Case:
    """The case with a mesh changed once to three times; now and then its recipe too, or the path to it."""
    (name,) = case.files
    for _ in range(pick((1, 1, 2, 3), random)):
        case = replace(case, files={name: _changed(case.files[name], name, random)}, done=(*case.done, "mesh"))
    if random.random() < 0.1:
        case = by_structure(case, random)
    return by_file(case, random) if random.random() < 0.1 else case


def _changed(data: bytes, name: str, random: np.random.Generator) -> bytes:
    text = name in ("text.stl", "ball.obj", "sheet.obj", "text.ply", "parts.off", "parts.dae", "parts.txt")
    ways = [numbers, numbers, odd_lines, odd_lines, damaged] if text else [_words, _words, _words, damaged, odd_lines]
    if name.endswith((".glb", ".gltf")):
        ways = [_tree, _tree, _tree, _words, damaged]
    elif name.endswith(".3mf"):
        ways = [_inside, _inside, _inside, damaged]
    return pick(ways, random)(data, random)


def _words(data: bytes, random: np.random.Generator) -> bytes:
    """Numbers of four bytes changed, where binary files have them: after the head, at steps of two bytes."""
    for _ in range(int(pick((1, 1, 3, 100), random))):
        start = 80 if random.random() < 0.3 else int(random.integers(max(len(data) - 4, 1)))
        data = data[:start] + pick(ODD_WORDS, random) + data[start + 4 :]
    return data


ODD_VALUES = (
    0, -1, 1, 3, 1e9, 10**9, 10**12, 2**31, 0.5, "x", "../outside/x.bin", "file:///etc/passwd", "data:,x",
    "/dev/zero", None, [], {}, [0], [0] * 1000, True, 5126, "SCALAR", "VEC3", "MAT4",
)  # fmt: skip


def _tree(data: bytes, random: np.random.Generator) -> bytes:
    """The description in a GLB or glTF changed: counts, offsets, types, links; the lengths in the file stay right."""
    try:
        size = struct.unpack("<I", data[12:16])[0]
        bare = data[:4] != b"glTF"
        tree = json.loads(data if bare else data[20 : 20 + size])
        where = list(places(tree))
        holder, key = pick(where, random)
    except (ValueError, struct.error, IndexError):
        return damaged(data, random)
    how = int(random.integers(5))
    if how == 0:
        del holder[key]
    elif how == 1 and isinstance(holder, list):
        holder.extend([holder[key]] * int(pick((1, 100, 10_000), random)))
    elif how == 2:
        other, name = pick(where, random)
        holder[key] = json.loads(json.dumps(other[name]))
    else:
        holder[key] = pick(ODD_VALUES, random)
    text = json.dumps(tree).encode()
    if bare:
        return text
    text += b" " * (-len(text) % 4)
    rest = data[20 + size :]
    return b"glTF" + struct.pack("<IIII", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest
