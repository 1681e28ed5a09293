"""glTF 2: a GLB, or a .gltf with its buffers in the text or in its own folder, read as the GLB that it stands for.

Khronos (2021), "glTF 2.0 Specification". Axes as in the file (y up), in metres; every node in its place.
"""

from __future__ import annotations

import base64
import binascii
import json
from itertools import accumulate
from pathlib import Path
from typing import Any, Final
from urllib.parse import unquote

from sonarsynth.description import named_files
from sonarsynth.description.memory import max_facets
from sonarsynth.geometry.surfaces import MeshError, Surface
from sonarsynth.targets.mesh_readers.mesh_trimesh import by_trimesh

FANS: Final = 6
"""The mode of a primitive."""
MAX_BYTES: Final = 1 << 30
JSON: Final = 0x4E4F534A
BIN: Final = 0x004E4942
NOT_OF_SHAPE: Final = ("images", "textures", "samplers", "materials", "animations", "skins", "cameras")


def read_glb(data: bytes) -> Surface:
    """A GLB file says its length, and describes what it holds."""
    if data[:4] != b"glTF" or len(data) < 12:
        raise MeshError("is no GLB file")
    size = int.from_bytes(data[8:12], "little")
    if len(data) < size:
        raise MeshError(f"is cut off: {len(data)} bytes where its header says {size}")
    length = int.from_bytes(data[12:16], "little")
    try:
        tree = json.loads(data[20 : 20 + length])
        reason = _unread(tree) or _absurd(tree)
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError) as error:
        reason = f"cannot be read as GLB ({type(error).__name__} in its description)"
    if reason:
        raise MeshError(reason)
    return by_trimesh("glb", data)


def _unread(tree: dict[str, Any]) -> str | None:
    """What a GLB file needs and trimesh leaves out without a word."""
    if needed := [e for e in tree.get("extensionsRequired", []) if not str(e).startswith(("KHR_materials", "KHR_tex"))]:
        return f"needs the extension {str(needed[0])[:40]}, which is not read"
    for number, accessor in enumerate(tree.get("accessors", [])):
        if "sparse" in accessor:
            return f"accessor {number} is sparse, which is not read"
    modes = {p.get("mode") for mesh in tree.get("meshes", []) for p in mesh["primitives"]}
    if FANS in modes:
        return "holds fans of triangles, which are not read"
    return None


def _absurd(tree: dict[str, Any]) -> str | None:
    """Why the description in a GLB file cannot be believed: numbers that stand nowhere, a mesh placed without end."""
    for number, accessor in enumerate(tree.get("accessors", [])):
        if "bufferView" not in accessor:
            return f"accessor {number} has {accessor['count']} values that are not in the file"
    nodes = tree.get("nodes", [])
    placed = sorted(child for node in nodes for child in node.get("children", []))
    if len(set(placed)) < len(placed):
        return "has a node that is in two places"
    facets = [
        sum(int(tree["accessors"][p.get("indices", p["attributes"]["POSITION"])]["count"]) for p in mesh["primitives"])
        for mesh in tree.get("meshes", [])
    ]
    total = sum(facets[node["mesh"]] for node in nodes if "mesh" in node)
    return f"places {total} corners, more than of {max_facets()} facets" if total > 3 * max_facets() else None


def read_gltf(data: bytes, folder: Path) -> Surface:
    """A glTF of text; buffers that it names lie in `folder`. Raises MeshError."""
    try:
        tree = json.loads(data.decode("utf-8-sig"))
        for name in NOT_OF_SHAPE:
            tree.pop(name, None)
        for mesh in tree.get("meshes", []):
            for primitive in mesh["primitives"]:
                primitive.pop("material", None)
        buffers: list[bytes] = []
        room = MAX_BYTES
        for buffer in tree.get("buffers", []):
            buffers.append(_buffer(buffer, folder, room))
            room -= len(buffers[-1])
        starts = [0, *accumulate(map(len, buffers))]
        for view in tree.get("bufferViews", []):
            view["byteOffset"] = view.get("byteOffset", 0) + starts[view["buffer"]]
            view["buffer"] = 0
        body = b"".join(buffers)
        body += bytes(-len(body) % 4)
        tree["buffers"] = [{"byteLength": len(body)}] if body else []
        text = json.dumps(tree).encode()
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError) as error:
        if isinstance(error, MeshError):
            raise
        raise MeshError(f"cannot be read as glTF ({type(error).__name__} in its description)") from None
    text += b" " * (-len(text) % 4)
    chunks = _chunk(JSON, text) + (_chunk(BIN, body) if body else b"")
    return read_glb(b"glTF" + (2).to_bytes(4, "little") + (12 + len(chunks)).to_bytes(4, "little") + chunks)


def _chunk(kind: int, data: bytes) -> bytes:
    return len(data).to_bytes(4, "little") + kind.to_bytes(4, "little") + data


def _buffer(buffer: dict[str, Any], folder: Path, limit: int) -> bytes:
    """The bytes of a buffer, padded to a whole number of words, of `limit` at most. Raises MeshError."""
    name = str(buffer.get("uri", ""))
    if name.startswith("data:"):
        try:
            content = base64.b64decode(name.partition(",")[2], validate=True)
        except binascii.Error:
            raise MeshError("has a buffer in its text that is no base64") from None
    else:
        file = folder / unquote(name)
        inside = not Path(unquote(name)).is_absolute() and file.resolve().is_relative_to(folder.resolve())
        if not name or ":" in name or not inside:
            raise MeshError(f"names a buffer outside its folder: '{name[:60]}'")
        of_total = "" if limit == MAX_BYTES else f" (of {MAX_BYTES >> 20} MiB for all buffers)"
        try:
            content = named_files.read(file, limit)
        except named_files.FileError as error:
            raise MeshError(f"names the buffer '{name[:60]}', which {error}{of_total}") from None
    if len(content) + 3 > limit:
        raise MeshError(f"has buffers of more than {MAX_BYTES >> 20} MiB together")
    if len(content) < int(buffer["byteLength"]):
        raise MeshError(f"has a buffer of {len(content)} bytes where it says {buffer['byteLength']}")
    return content + bytes(-len(content) % 4)
