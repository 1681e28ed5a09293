"""Real recipes with their files, and what may be wrong with them: by their schema, structure, text, bytes and files."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from ruamel.yaml import YAML
from scipy.io import wavfile

from fault_injection.schemas import drawn, spots, whole

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
SMALL_ARRAY = "{kind: planar_lattice, columns: 6, rows: 4, pitch: 5 cm}"

NUMBERS = (0, -1, 1, 2, 0.5, 1e-300, 1e300, -1e300, 1e15, -1e15, 1e12, 1e9, 10**9, 10**12, 2**31, 2**63, 2**64, 10**30)
TEXTS = (
    "", " ", "x" * 100_000, "1 m", "1 km", "-5 ft", "3 furlong", "1e400 m", "nan m", "inf Hz", "-inf dB", "1_0 m",
    "1 m m", "\0", "\x1b[31m", "a\nb", "\u202e", "\u2028", "no", "auto", "null", "true", "1e-3", "0x10",
    "scene.world", "{}", "é",
)  # fmt: skip
TOKENS = (
    ".nan", ".inf", "-.inf", "1e400", "1" * 5000, "0x" + "f" * 5000, "010", "0o9", "190:20:30", "2001-12-14", "~",
    "yes", "1_000", "!!python/object/apply:os.system [id]", "!!binary aGk=", "!!bool maybe", "!!float x", "!!set {a}",
    "!x 1", "*nowhere", "&a [*a]", "[" * 70 + "]" * 70, "[" * 3000, '"\\ud800"', '"\\x00"', "{<<: {a: 1}}",
    "{a: 1, a: 2}", "[1, 2", "'", "? [a]", "@", "`", "%", "\t1", "|\n", ">-\n  a",
)  # fmt: skip
LINES = (
    "%YAML 1.1\n---", "---", "...", "--- a", "x: &a {b: 1}", "y: *a", "<<: {seed: 3}", "\t", "seed: 2",
    "title: again", "scene: {}", "}", "# \0", "grid: [{path: scene.world.targets, values: [[], []]}]",
    "repeats: 100000000", "repeats: 100000001",
    "a0: &a0 [1, 1]\n" + "\n".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 30)),
    "grid: [{path: scene.world.environment.depth, first: 9, last: 50, count: 90000}]",
    "variations: [{path: scene.world.environment.depth, kind: normal, mean: 20 m, deviation: 1e300 m}]",
    "variations: [{path: scene.trajectory.start, kind: uniform, low: -1e308, high: 1e308}]",
    "accuracy: {signal: 1e-300}", "splits: {train: 1e-300, test: 1}", "rays: {directions: [[0, 0]], duration: 1e9}",
)  # fmt: skip
ELSEWHERE = (
    "/etc/passwd", "/dev/zero", "/dev/stdin", "/proc/self/mem", "/proc/self/environ", "../outside/good.{}",
    "x/../../outside/good.{}", "~/good.{}", "file:///etc/passwd", f"http{':'}//127.0.0.1:9/good.{{}}", "s3://bucket/good.{}",
    "\\\\host\\good.{}", ".", "..", "/", "", " ", "none.{}", "a\0b.{}", "n" * 300 + ".{}", "d/" * 3000 + "good.{}",
    "link.{}", "folder/good.{}", "zero.{}", "pipe.{}", "loop.{}", "folder.{}", "bomb.{}", "huge.{}", "case.yaml",
)  # fmt: skip
"""Paths that no recipe may name, or that hold nothing good; {} is the ending."""


@dataclass(frozen=True)
class Case:
    """A recipe and its files (relative to the folder of the recipe)."""

    name: str
    text: bytes
    files: dict[str, bytes] = field(default_factory=dict)
    must_refuse: bool = False
    done: tuple[str, ...] = ()  # the mutations


def cast_file() -> bytes:
    """A cast as an instrument writes it."""
    depth = np.linspace(0.15, 24.0, 60)
    rows = [f"{d * 1.01:.3f},{d:.3f},{16.5 - 0.02 * d:.4f},{35.6:.3f},{1511.9 - 0.05 * d:.4f}" for d in depth]
    names = "Pressure (Decibar),Depth (Meter),Temperature (Celsius),Salinity (Practical Salinity Scale)"
    head = f"% Device,CC1\n% Start latitude,-36.2\n{names},Sound velocity (Meters per Second)"
    return "\n".join([head, *rows, ""]).encode()


def snap_files() -> dict[str, bytes]:
    """A snap as text and as WAV."""
    t = (np.arange(400) - 120) * 2e-6
    p = 2e3 * (1 - (t / 8e-6) ** 2) * np.exp(-0.5 * (t / 8e-6) ** 2)
    wav = io.BytesIO()
    wavfile.write(wav, 500_000, np.round(p / 2e3 * 20_000).astype(np.int16))
    rows = "".join(f"{a:.7e},{b:.6g}\n" for a, b in zip(t, p, strict=True))
    return {"snap.csv": b"time (s),pressure (Pa)\n" + rows.encode(), "snap.wav": wav.getvalue()}


def bases() -> list[Case]:
    """The recipes in configs/, of two frames and with a small array; some with a cast, a snap and a hull in files."""
    hull = trimesh.creation.cylinder(radius=0.3, height=1.2, sections=12).export(file_type="stl")
    files = {"castaway_ctd.csv": cast_file(), "rexrov.stl": bytes(hull)}
    found = []
    for path in sorted(CONFIGS.glob("*.yaml")):
        text = re.sub(r"frames: \d+", "frames: 2", path.read_text())
        text = text.replace("{kind: romanis}", SMALL_ARRAY).replace("repeats: 10000", "repeats: 3")
        text = re.sub(r"(azimuths|elevations): \d+", r"\1: 11", text)
        if "array:" not in text:
            text = text.replace("  sonar:\n", f"  sonar:\n    array: {SMALL_ARRAY}\n", 1)
        named = {name: data for name, data in files.items() if name in text}
        found.append(Case(path.stem, text.encode(), named))
    for name, data in snap_files().items():
        here = next(case for case in found if case.name == "harbour")
        snap = f"snap: {{kind: recorded_snap, path: {name}, fade: 0.1}}".encode()
        found.append(
            replace(
                here, name=name, text=here.text.replace(b"source_level: 190 dB", snap), files=here.files | {name: data}
            )
        )
    return found


def mutated(case: Case, random: np.random.Generator) -> Case:
    """The case with one to three things changed."""
    ways = [by_schema] * 8 + [by_structure] * 6 + [by_token] * 2 + [by_lines, by_bytes]
    for _ in range(pick((1, 1, 2, 3), random)):
        way = ways[int(random.integers(len(ways)))]
        if case.files and random.random() < 0.5:
            way = by_file
        case = way(case, random)
    return case


def pick(some: Any, random: np.random.Generator) -> Any:
    """One of several, by number: numpy would turn them into an array."""
    return some[int(random.integers(len(some)))]


def by_schema(case: Case, random: np.random.Generator) -> Case:
    """A field of the whole schema, there or left out, set to a value that its schema allows."""
    try:
        data = loaded(case.text)
        holder, key, schema = pick(spots(data, whole(), random), random)
        holder[key] = drawn(schema, random)
        text = json.dumps(data, indent=1)
    except Exception:  # an earlier mutation left no YAML
        return by_bytes(case, random)
    return replace(case, text=text.encode("utf-8", "replace"), done=(*case.done, f"schema {key}"[:60]))


def by_structure(case: Case, random: np.random.Generator) -> Case:
    """Another value, a missing or added field, entries repeated, a number scaled, a part of the recipe elsewhere."""
    try:
        data = loaded(case.text)
        where = list(places(data))
        text = json.dumps(data, indent=1)
    except Exception:  # an earlier mutation left no YAML
        return by_bytes(case, random)
    if not where:
        return by_bytes(case, random)
    holder, key = pick(where, random)
    value, how = holder[key], pick(HOWS, random)
    if how == "value":
        holder[key] = pick(
            (*NUMBERS, *TEXTS, None, True, False, [], {}, [[]], [1] * 1000, [0, 0, 0], {"kind": "x"}), random
        )
    elif how == "scale" and isinstance(value, (int, float, str)):
        holder[key] = _scaled(value, random)
    elif how == "elsewhere":
        other, name = pick(where, random)
        holder[key] = json.loads(json.dumps(other[name], default=str))
    elif how == "field" and isinstance(holder, dict):
        holder[pick(("kind", "extra", "path", "", "0", f"{key}s", "\u00e9", "a.b", "__class__"), random)] = (
            holder.pop(key) if random.random() < 0.5 else value
        )
    elif how == "repeat" and isinstance(holder, list):
        holder.extend([value] * int(pick((1, 10, 1000, 100_000), random)))
    else:
        del holder[key]
    text = json.dumps(data, indent=1, default=str)
    return replace(case, text=text.encode("utf-8", "replace"), done=(*case.done, f"{how} {key}"[:60]))


MOST_PLACES = 1_000_000
"""Values of a recipe that is changed by its structure."""
HOWS = ("value", "value", "scale", "scale", "scale", "elsewhere", "field", "repeat", "delete")


def loaded(text: bytes) -> Any:
    """The values of a YAML text. Raises ValueError where there are very many: aliases of aliases fill any memory."""
    data = YAML(typ="safe", pure=True).load(text.decode())
    if sum(1 for _ in islice(places(data), MOST_PLACES)) == MOST_PLACES:
        raise ValueError("an earlier mutation left too many values")
    return data


def places(data: Any) -> Any:
    """Every holder and key."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in list(items):
        yield data, key
        yield from places(value)


def _scaled(value: Any, random: np.random.Generator) -> Any:
    """A number, or the number in a text, times a power of ten, or of the other sign."""
    factor = float(pick((-1.0, 0.0, 10.0 ** int(random.integers(-15, 16)), 1.5, 0.5, 1000.0), random))
    if isinstance(value, str):
        number, _, unit = value.partition(" ")
        try:
            return f"{float(number) * factor!r} {unit}".strip()
        except ValueError:
            return value[::-1]
    scaled = value * factor
    return int(scaled) if isinstance(value, int) and abs(scaled) < 1e18 else scaled


def by_token(case: Case, random: np.random.Generator) -> Case:
    """A word of the text replaced by one that YAML reads in its own way."""
    text = case.text.decode("utf-8", "replace")
    words = list(re.finditer(r"(?<=: )[^\s,{}\[\]]+", text))
    if not words:
        return by_bytes(case, random)
    word, token = pick(words, random), pick(TOKENS, random)
    text = text[: word.start()] + token + text[word.end() :]
    return replace(case, text=text.encode("utf-8", "replace"), done=(*case.done, f"token {token[:30]}"))


def by_lines(case: Case, random: np.random.Generator) -> Case:
    """A line added, taken away, repeated, indented or moved."""
    lines = case.text.decode("utf-8", "replace").split("\n")
    n, how = int(random.integers(len(lines))), pick(("add", "drop", "repeat", "indent", "swap", "tab"), random)
    if how == "add":
        lines.insert(pick((0, n, len(lines)), random), pick(LINES, random))
    elif how == "drop":
        del lines[n]
    elif how == "repeat":
        lines[n:n] = [lines[n]] * int(pick((1, 2, 20_000), random))
    elif how == "indent":
        lines[n] = " " * int(random.integers(1, 9)) + lines[n]
    elif how == "tab":
        lines[n] = "\t" + lines[n]
    else:
        m = int(random.integers(len(lines)))
        lines[n], lines[m] = lines[m], lines[n]
    return replace(case, text="\n".join(lines).encode(), done=(*case.done, f"line {how}"))


def by_bytes(case: Case, random: np.random.Generator) -> Case:
    """Bytes of the recipe changed."""
    return replace(case, text=damaged(case.text, random), done=(*case.done, "bytes"))


def damaged(data: bytes, random: np.random.Generator) -> bytes:
    """Bytes flipped, cut off, put in, taken out, repeated or exchanged."""
    size = max(len(data), 1)
    at, length = int(random.integers(size)), int(random.integers(1, 1 + max(size // 8, 1)))
    how = int(random.integers(8))
    if how == 0:
        return data[:at]
    if how == 1:
        return data[:at] + random.bytes(length) + data[at:]
    if how == 2:
        return data[:at] + data[at + length :]
    if how == 3:
        return data[:at] + data[at : at + length] * int(pick((2, 3, 100), random)) + data[at + length :]
    if how == 4:
        return data[:at] + bytes(length) + data[at + length :]
    if how == 5:
        return pick(
            (b"", b"\xff\xfe" + data, b"\xef\xbb\xbf" + data, data[::-1], b"PK\x03\x04" + data, b"\x1f\x8b" + data),
            random,
        )
    changed = bytearray(data)
    for _ in range(int(pick((1, 1, 5, 50), random))):
        if changed:
            changed[int(random.integers(len(changed)))] = int(random.integers(256))
    return bytes(changed)


def by_file(case: Case, random: np.random.Generator) -> Case:
    """Another path, or other contents, for one of the files."""
    name = pick(sorted(case.files), random)
    if random.random() < 0.3:
        path = pick(ELSEWHERE, random).format(name.rpartition(".")[2])
        text = case.text.decode("utf-8", "replace")
        quoted = json.dumps(path)
        there = text.replace(f"path: {name}", f"path: {quoted}").replace(f'"path": "{name}"', f'"path": {quoted}')
        return replace(case, text=there.encode(), must_refuse=there != text, done=(*case.done, f"path {path[:40]}"))
    data = case.files[name]
    data = (
        numbers(data, random)
        if random.random() < 0.6 and not name.endswith((".stl", ".wav"))
        else damaged(data, random)
    )
    return replace(case, files=case.files | {name: data}, done=(*case.done, f"file {name}"))


def numbers(data: bytes, random: np.random.Generator) -> bytes:
    """Numbers of a text changed."""
    found = list(re.finditer(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?", data))
    chosen = random.permutation(len(found))[: pick((1, 1, 3, 30), random)]
    for one in sorted((found[n] for n in chosen), key=lambda match: -match.start()):  # from the end
        data = data[: one.start()] + pick(ODD_NUMBERS, random) + data[one.end() :]
    return data


def lines_changed(odd: tuple[bytes, ...]) -> Callable[[bytes, np.random.Generator], bytes]:
    """A change of a text: a line added (of some odd ones), dropped, repeated, or put elsewhere."""

    def change(data: bytes, random: np.random.Generator) -> bytes:
        lines = data.split(b"\n")
        n, how = int(random.integers(len(lines))), int(random.integers(4))
        if how == 0:
            lines[n:n] = [pick(odd, random)] * int(pick((1, 1, 100), random))
        elif how == 1:
            del lines[n : n + int(pick((1, 5, 1000), random))]
        elif how == 2:
            lines[n:n] = [lines[n]] * int(pick((1, 1000), random))
        else:
            lines.insert(int(random.integers(len(lines))), lines.pop(n))
        return b"\n".join(lines)

    return change


ODD_NUMBERS = (
    b"nan", b"-9999", b"0", b"-1", b"1e400", b"inf", b"1e30", b"1e-30", b"", b"x", b"99999999999999999999",
    b"2147483648", b"-2147483649", b"4294967295", b"1,5", b"0.5", b"3", b"7", b"1" * 5000,
)  # fmt: skip
