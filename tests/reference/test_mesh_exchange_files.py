"""Meshes as vehicles' makers and simulators exchange them: every part in its place, in metres, or refused."""

from __future__ import annotations

import base64
import io
import json
import zipfile

import numpy as np
import pytest

from sonarsynth.targets.mesh_readers import mesh_gltf
from sonarsynth.targets.meshes import MeshError, mesh_of
from sonarsynth.targets.shapes import MeshFile

S = "//"
CORNERS = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [0, 0, 3], [2, 0, 3], [2, 1, 3], [0, 1, 3]], float)
QUADS = ((3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
"""A box of 2 by 1 by 3, its polygons counter-clockwise from outside."""
TRIANGLES = [t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))]


def collada(nodes, unit=1.0, up="Z_UP", library="", kind="polylist"):
    numbers = " ".join(f"{v:g}" for v in CORNERS.ravel())
    if kind == "polylist":
        index = f"<vcount>{'4 ' * 6}</vcount><p>{' '.join(str(i) for q in QUADS for i in q)}</p>"
    else:
        index = f"<p>{' '.join(str(i) for t in TRIANGLES for i in t)}</p>"
    count = 6 if kind == "polylist" else 12
    return f"""<?xml version="1.0"?><COLLADA xmlns="http:{S}www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="x" meter="{unit}"/><up_axis>{up}</up_axis></asset>
<library_geometries><geometry id="box"><mesh><source id="p"><float_array id="a" count="24">{numbers}</float_array>
<technique_common><accessor source="#a" count="8" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<{kind} count="{count}"><input semantic="VERTEX" source="#v" offset="0"/>{index}</{kind}></mesh></geometry>
</library_geometries>{library}
<library_visual_scenes><visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


BOX = '<instance_geometry url="#box"/>'


def mesh(folder, name, content, **how):
    file = folder / name
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return mesh_of(MeshFile(path=str(file), **how))


def volume(made):
    a, b, c = np.moveaxis(made.corners, 1, 0)
    return float(np.einsum("fi,fi->", a, np.cross(b, c)) / 6.0)


@pytest.mark.parametrize("kind", ["polylist", "triangles"])
@pytest.mark.parametrize(("unit", "up"), [(1.0, "Z_UP"), (0.01, "Z_UP"), (0.0254, "Y_UP"), (1.0, "X_UP")])
def test_collada_by_its_unit_and_its_upward_axis(tmp_path, kind, unit, up):
    made = mesh(tmp_path, "box.dae", collada(f'<node id="n">{BOX}</node>', unit, up, kind=kind))
    size = {"Z_UP": [2, 1, 3], "Y_UP": [2, 3, 1], "X_UP": [1, 3, 2]}[up]
    np.testing.assert_allclose(np.ptp(made.box, axis=0), unit * np.array(size), rtol=1e-6)
    assert volume(made) == pytest.approx(6.0 * unit**3) and len(made.faces) == 12


def test_collada_places_each_instance(tmp_path):
    """A shift of a turn of a shift, and a node of the library that is placed twice."""
    inner = f'<node id="i"><translate>10 0 0</translate><rotate>0 0 1 90</rotate>{BOX}</node>'
    library = f'<library_nodes><node id="twice"><scale>1 1 2</scale>{BOX}</node></library_nodes>'
    nodes = f"""<node id="a"><translate>0 0 5</translate>{inner}</node>
    <node id="b"><translate>0 50 0</translate><instance_node url="#twice"/></node>
    <node id="c"><translate>0 70 0</translate><instance_node url="#twice"/></node>"""
    made = mesh(tmp_path, "boxes.dae", collada(nodes, library=library))
    assert len(made.faces) == 36 and volume(made) == pytest.approx(6.0 + 12.0 + 12.0)
    np.testing.assert_allclose(made.box, [[0, 0, 0], [10, 71, 8]], atol=1e-6)
    turned = made.vertices[made.vertices[:, 0] > 5.0]
    np.testing.assert_allclose([turned.min(axis=0), turned.max(axis=0)], [[9, 0, 5], [10, 2, 8]], atol=1e-6)


def test_a_packed_collada(tmp_path):
    box = io.BytesIO()
    with zipfile.ZipFile(box, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("../../box.dae", collada(f'<node id="n">{BOX}</node>'))
    assert volume(mesh(tmp_path, "box.zae", box.getvalue())) == pytest.approx(6.0)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["box.zae"]


def threemf(build, objects="", unit="millimeter"):
    vertices = "".join('<vertex x="{:g}" y="{:g}" z="{:g}"/>'.format(*v) for v in CORNERS)
    triangles = "".join('<triangle v1="{}" v2="{}" v3="{}"/>'.format(*t) for t in TRIANGLES)
    model = (
        f'<model unit="{unit}" xmlns="http:{S}schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>'
        f'<object id="1"><mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh></object>'
        f"{objects}"
        f"</resources><build>{build}</build></model>"
    )
    box = io.BytesIO()
    with zipfile.ZipFile(box, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("3D/3dmodel.model", model)
    return box.getvalue()


def test_3mf_places_items_and_components_in_its_unit(tmp_path):
    made = mesh(tmp_path, "a.3mf", threemf('<item objectid="1"/>', unit="inch"))
    np.testing.assert_allclose(np.ptp(made.box, axis=0), 0.0254 * np.array([2, 1, 3]))
    both = '<object id="2"><components><component objectid="1"/><component objectid="1" transform="'
    both += '0 1 0 -1 0 0 0 0 1 100 0 0"/></components></object>'
    made = mesh(tmp_path, "b.3mf", threemf('<item objectid="2" transform="1 0 0 0 1 0 0 0 1 0 0 7"/>', both, "meter"))
    assert volume(made) == pytest.approx(12.0)
    np.testing.assert_allclose(made.box, [[0, 0, 7], [100, 2, 10]])


def gltf(uri):
    faces, places = np.array(TRIANGLES, "<u4").tobytes(), CORNERS.astype("<f4").tobytes()
    views = [{"buffer": 0, "byteLength": len(faces)}, {"buffer": 1, "byteLength": len(places)}]
    accessors = [
        {"bufferView": 0, "componentType": 5125, "count": 36, "type": "SCALAR"},
        {"bufferView": 1, "componentType": 5126, "count": 8, "type": "VEC3", "min": [0, 0, 0], "max": [2, 1, 3]},
    ]
    inline = "data:application/octet-stream;base64," + base64.b64encode(faces).decode()
    tree = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"children": [1], "scale": [2, 2, 2]}, {"mesh": 0, "translation": [0, 0, 4]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 1}, "indices": 0}]}],
        "accessors": accessors, "bufferViews": views,
        "buffers": [{"uri": inline, "byteLength": len(faces)}, {"uri": uri, "byteLength": len(places)}],
    }  # fmt: skip
    return json.dumps(tree), places


def test_gltf_with_a_buffer_in_its_folder_and_in_its_text(tmp_path):
    text, places = gltf("box%20one.bin")
    (tmp_path / "box one.bin").write_bytes(places)
    made = mesh(tmp_path, "box.gltf", text)
    np.testing.assert_allclose(made.box, [[0, 0, 8], [4, 2, 14]])
    assert volume(made) == pytest.approx(48.0)


def test_the_buffers_of_a_gltf_are_bounded_together(tmp_path, monkeypatch):
    """Each may be small, and there may be many: here the first leaves no room for the second."""
    text, places = gltf("box.bin")
    (tmp_path / "box.bin").write_bytes(places)
    monkeypatch.setattr(mesh_gltf, "MAX_BYTES", 144 + len(places) - 1)
    with pytest.raises(MeshError, match=r"names the buffer 'box.bin', which is larger than 0 MiB \(of 0 MiB for all"):
        mesh(tmp_path, "box.gltf", text)
    monkeypatch.setattr(mesh_gltf, "MAX_BYTES", 100)
    with pytest.raises(MeshError, match="has buffers of more than 0 MiB together"):
        mesh(tmp_path, "box.gltf", text)
    monkeypatch.setattr(mesh_gltf, "MAX_BYTES", 144 + len(places) + 3)
    assert volume(mesh(tmp_path, "box.gltf", text)) == pytest.approx(48.0)


def test_three_lines_a_facet(tmp_path):
    text = "".join("{:g} {:g} {:g}\n".format(*CORNERS[i]) for t in TRIANGLES for i in t)
    assert volume(mesh(tmp_path, "box.txt", text)) == pytest.approx(6.0)
    with pytest.raises(MeshError, match="has 35 corners, not three for each facet"):
        mesh(tmp_path, "cut.txt", text.rstrip("\n").rpartition("\n")[0])
    with pytest.raises(MeshError, match="line 1: is not the x, y and z of a corner"):
        mesh(tmp_path, "words.txt", "a b\n")


SELF = '<node id="n"><instance_node url="#n"/></node>'
SWELLING = "".join(
    f'<node id="n{i}"><instance_node url="#n{i + 1}"/><instance_node url="#n{i + 1}"/></node>' for i in range(40)
)
BOMB = '<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]><COLLADA>&b;</COLLADA>'
DEEP = "".join(
    f'<object id="{i}"><components>{f"""<component objectid="{i + 1}"/>""" * 9}</components></object>'
    for i in range(2, 16)
)
REFUSED = {
    "bomb.dae": (BOMB, "declares a document type or entities"),
    "self.dae": (collada("", library=f"<library_nodes>{SELF}</library_nodes>"), "placed in itself"),
    "swelling.dae": (
        collada("", library=f'<library_nodes>{SWELLING}<node id="n40">{BOX}</node></library_nodes>'),
        "places more than 100000 nodes",
    ),
    "other.dae": (
        collada('<node id="n"><instance_geometry url="../other.dae#box"/></node>'),
        "cannot be read|has a part that cannot",
    ),
    "lost.dae": (collada('<node id="n"><instance_geometry url="#none"/></node>'), "has a part that cannot be read"),
    "none.dae": ("<svg/>", "is no COLLADA file"),
    "empty.dae": (collada(""), "holds no facets"),
    "empty.zae": (threemf(""), "is an archive without a .dae"),
    "broken.3mf": (b"PK\3\4" + bytes(60), "is an archive that cannot be unpacked"),
    "swelling.3mf": (
        threemf('<item objectid="2"/>', DEEP + '<object id="16"><components/></object>'),
        "components within components without end",
    ),
    "infinite.3mf": (
        threemf('<item objectid="1" transform="1e999 0 0 0 1 0 0 0 1 0 0 0"/>'),
        "a transform that is not 12 finite numbers",
    ),
    "overflowing.3mf": (
        threemf(
            '<item objectid="2" transform="1e300 1e300 0 -1e300 1 0 0 0 1 0 0 0"/>',
            '<object id="2"><components><component objectid="1" transform="1e300 1e300 0 1e300 1e300 0 0 0 1 0 0 0"/>'
            "</components></object>",
        ),
        "is not finite",
    ),
    "lost.3mf": (threemf('<item objectid="9"/>'), "places object '9', which is not in its model"),
    "outside.gltf": (gltf("../box.bin")[0], "names a buffer outside its folder"),
    "absolute.gltf": (gltf("/etc/passwd")[0], "names a buffer outside its folder"),
    "url.gltf": (gltf("http:" + "//127.0.0.1/x.bin")[0], "names a buffer outside its folder"),
    "missing.gltf": (gltf("none.bin")[0], "names the buffer 'none.bin', which no such file"),
    "list.gltf": ("[]", "cannot be read as glTF"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_leads_elsewhere_or_swells_is_refused(tmp_path, name):
    content, message = REFUSED[name]
    with pytest.raises(MeshError, match=message) as refused:
        mesh(tmp_path, name, content)
    assert "\n" not in str(refused.value)


def test_a_link_out_of_the_folder_is_not_followed(tmp_path):
    inner = tmp_path / "inner"
    inner.mkdir()
    text, places = gltf("box.bin")
    (tmp_path / "box.bin").write_bytes(places)
    (inner / "box.bin").symlink_to("../box.bin")
    with pytest.raises(MeshError, match="outside its folder"):
        mesh(inner, "box.gltf", text)


def test_a_sheet_of_both_sides_has_a_back(tmp_path):
    """Each facet of an open part twice, once turned; a closed part stays as it is."""
    sheet = "v 0 0 5\nv 1 0 5\nv 1 1 5\nv 0 1 5\nf 1 2 3 4\n"
    box = "".join("v {:g} {:g} {:g}\n".format(*v) for v in CORNERS)
    box += "".join("f {} {} {} {}\n".format(*(i + 5 for i in q)) for q in QUADS)
    one, both = (mesh(tmp_path, "sheet.obj", sheet + box, sides=sides) for sides in ("front", "both"))
    assert len(one.faces) == 14 and len(both.faces) == 16
    up = both.normal[both.centroid[:, 2] == 5.0][:, 2]
    assert sorted(up) == [-1, -1, 1, 1]
    assert any("2 facets of sheets scatter from both sides" in note for note in both.notes)
