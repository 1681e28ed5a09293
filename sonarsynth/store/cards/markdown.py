"""The card that people read."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any, Final

from sonarsynth.conventions import format_bytes
from sonarsynth.store.cards.facts import Facts, mapping_of

LIMITS: Final = (
    "Everything is simulated; nothing was measured at sea.",
    "Frames that are not built read as NaN, or as -1 in integer variables.",
    "Frames of a sequence resemble each other: split by `split`, never by frame.",
)
"""What holds of every dataset."""

DIGESTS: Final = (
    "That finds damage, not forgery: anyone who changes a store can also rewrite its digests. Against forgery, compare "
    "the `SHA-256` of your copy with a list from its makers."
)
"""What digests prove, and what they do not."""

_MOST_LINES: Final = 400
"""Lines of a recipe that a card shows."""


_MARKUP: Final = re.compile(r"([\\`*\[\]|~$])")
"""What has a meaning within a line; `_` within a word has none."""

_BEGINS: Final = re.compile(r"^(\d*)([#>+\-=:.)_])")
"""What has one at its beginning."""


def markdown(facts: Facts) -> str:
    """The card of a store."""
    sections = (
        _head(facts),
        _section("How to load it", _loading(facts)),
        _section("Contents", _variables(facts)),
        _section("Splits", _splits(facts)),
        _section("How it was made", _methods(facts)),
        _section("What is left out", _left_out(facts)),
        _section("Known limits", _limits(facts)),
        _section("Provenance", _origin(facts)),
        _section("The recipe", _recipe(facts)),
        _section("Licence and citation", _rights(facts)),
    )
    return "\n\n".join(section for section in sections if section) + "\n"


def _holds(facts: Facts) -> list[str]:
    products = [str(product) for product in facts.attributes.get("products", [])]
    return [*products, "truth", *(["link_budget"] if products else [])]


def _head(facts: Facts) -> str:
    rows = [
        ("frames", f"{facts.complete} of {facts.frames} are there"),
        ("sequences", str(facts.plan.get("sequences", ""))),
        ("holds", ", ".join(_holds(facts))),
        ("size", f"{format_bytes(facts.bytes)} in {facts.files} files"),
        ("format", "Zarr 3, one folder; one chunk a frame, CRC-32C on each"),
        ("version", str(facts.dataset.get("version", ""))),
        ("begun", facts.created),
        ("licence", str(facts.attributes.get("licence", ""))),
    ]
    title, summary = _text(facts.title), _paragraphs(facts.summary)
    return "\n\n".join([f"# {title}", summary, _table(("", ""), [r for r in rows if r[1]])])


def _loading(facts: Facts) -> str:
    example = next((a for a in facts.arrays if a.framed and a.group == "image"), None) or next(
        (a for a in facts.arrays if a.framed and a.group), None
    )
    address = facts.url or facts.name
    lines = ["import xarray as xr", f'tree = xr.open_datatree({json.dumps(address)}, engine="zarr")']
    if example is not None:
        comment = f"{example.meaning}, {example.units}"
        lines.append(f"first = tree[{json.dumps(example.path)}].isel(frame=0)  # {' '.join(comment.split())}")
    code = "```python\n" + "\n".join(lines).replace("`", "'") + "\n```"
    return f"{code}\n\n{_code(f'sonarsynth verify {address}')} compares every file with its digest. {DIGESTS}"


def _variables(facts: Facts) -> str:
    texts = []
    for group, arrays in groupby(facts.arrays, key=lambda a: a.group):
        rows = [
            (
                Cell(_code(a.path.rpartition("/")[2])),
                ", ".join(f"{d} {n}" for d, n in zip(a.dims, a.shape, strict=True)) or "one value",
                a.dtype,
                a.units,
                a.meaning,
            )
            for a in arrays
        ]
        texts.append(f"### {_code(f'/{group}')}\n\n" + _table(("name", "dimensions", "type", "units", "meaning"), rows))
    return "\n\n".join(texts)


def _splits(facts: Facts) -> str:
    splits, frames = facts.plan.get("splits"), facts.plan.get("frames_of_splits")
    if not isinstance(splits, Mapping) or not isinstance(frames, Mapping):
        return ""
    rows = [(name, str(count), str(frames.get(name))) for name, count in splits.items()]
    sentence = "By whole sequences: `split` of each frame is the number of a row, from 0."
    return f"{sentence}\n\n" + _table(("split", "sequences", "frames"), rows)


def _methods(facts: Facts) -> str:
    stages = _rows(facts.plan.get("stages"), ("stage", "method", "why", "error"))
    spans = [
        f"{' with '.join(map(str, entry['names']))} ({entry['values']} values)" for entry in facts.plan.get("grid", ())
    ] + [f"{v['name']} ({v['kind']}, drawn for each sequence)" for v in facts.plan.get("variations", ())]
    paragraphs = []
    if spans:
        paragraphs.append("The sequences span " + "; ".join(map(_text, spans)) + ".")
    if stages:
        paragraphs.append(_table(("stage", "method", "why", "error"), stages))
    return "\n\n".join(paragraphs)


def _left_out(facts: Facts) -> str:
    rows = _rows(facts.plan.get("left_out"), ("what", "why", "bound"))
    return _table(("what", "why", "error bound"), rows) if rows else ""


def _limits(facts: Facts) -> str:
    lines = [*LIMITS, *map(str, facts.plan.get("warnings", ()))]
    if facts.complete < facts.frames:
        lines.append(f"{facts.frames - facts.complete} of {facts.frames} frames are not built.")
    lines += [f"{count} frames failed ({why})." for why, count in facts.failed.items()]
    lines += [
        f"{count} frames were made with different libraries from the rest ({which}): last digits may differ."
        for which, count in facts.mixed.items()
    ]
    return "\n".join(f"- {_text(line)}" for line in lines)


def _origin(facts: Facts) -> str:
    provenance, attrs = facts.provenance, facts.attributes
    git, machine = mapping_of(provenance.get("git")), mapping_of(provenance.get("machine"))
    changed = {True: ", with changes that are not in it", False: "", None: ", perhaps with changes"}
    rows = [
        ("sonarsynth", str(attrs.get("sonarsynth_version", ""))),
        ("commit", f"{git['commit']}{changed.get(git.get('dirty'), '')}" if git.get("commit") else ""),
        ("digest of the code", str(attrs.get("code_digest", ""))),
        ("digest of the recipe", str(attrs.get("recipe_digest", ""))),
        ("seed", str(attrs.get("seed", ""))),
        ("machine", ", ".join(str(machine[k]) for k in ("cpu", "architecture", "distribution") if machine.get(k))),
        ("libraries", ", ".join(f"{name} {number}" for name, number in mapping_of(provenance.get("versions")).items())),
        *_inputs(mapping_of(attrs.get("inputs"))),
    ]
    return _table(("", ""), [row for row in rows if row[1]])


def _inputs(recorded: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    for target, digests in mapping_of(recorded.get("meshes")).items():
        more = f" and {len(digests) - 3} more" if len(digests) > 3 else ""
        yield f"mesh of {target} (SHA-256)", ", ".join(map(str, digests[:3])) + more
    for file in recorded.get("files", ()):
        yield f"file {file['name']} (SHA-256)", str(file["sha256"])


def _recipe(facts: Facts) -> str:
    written = str(facts.provenance.get("recipe_as_written", ""))
    if not written.strip():
        return "Written in Python; as resolved, it is the attribute `recipe` of the store."
    lines = written.rstrip().splitlines()
    cut = [f"# ... {len(lines) - _MOST_LINES} more lines, in the store"] if len(lines) > _MOST_LINES else []
    shown = "\n".join(lines[:_MOST_LINES] + cut)
    fence = "`" * max(3, *(len(run) + 1 for run in re.findall("`+", shown)), 3)
    settings = [f"Overridden: {_code(str(s))}" for s in facts.provenance.get("recipe_settings", ())]
    text = "As written; as resolved, with every default, it is the attribute `recipe` of the store."
    return "\n\n".join([text, f"{fence}yaml\n{shown}\n{fence}", *settings])


def _rights(facts: Facts) -> str:
    who = []
    for creator in map(mapping_of, facts.dataset.get("creators", ())):
        details = [str(creator[k]) for k in ("affiliation", "url") if creator.get(k)]
        who.append(f"- {_text(', '.join([str(creator.get('name', '')), *details]))}")
    licence = str(facts.attributes.get("licence", ""))
    texts = [f"Licence: {_text(licence)}" if licence else "", "\n".join(who), "To cite it:", _quoted(facts.citation)]
    return "\n\n".join(text for text in texts if text)


def _section(title: str, body: str) -> str:
    return f"## {title}\n\n{body}" if body else ""


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(map(_cell, line)) + " |" for line in lines)


def _rows(entries: Any, names: Sequence[str]) -> list[tuple[str, ...]]:
    rows = entries if isinstance(entries, list) else []
    return [tuple(str(mapping_of(row).get(name, "")) for name in names) for row in rows]


class Cell(str):
    """A text that is markup already."""


def _cell(text: str) -> str:
    return text.replace("|", "\\|") if isinstance(text, Cell) else _text(text)


def _text(text: str) -> str:
    """A text of the store as a part of a line, and nothing else: no tags, links, code or tables, no new lines."""
    plain = _MARKUP.sub(r"\\\1", " ".join(str(text).split()))
    return plain.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def _paragraphs(text: str) -> str:
    """A text of several paragraphs."""
    paragraphs = (_begun(_text(paragraph)) for paragraph in re.split(r"\n\s*\n", str(text)))
    return "\n\n".join(paragraph for paragraph in paragraphs if paragraph)


def _code(text: str) -> str:
    return "`" + " ".join(str(text).split()).replace("`", "'") + "`"


def _quoted(text: str) -> str:
    return "\n".join(f"> {_begun(_text(line))}".rstrip() for line in str(text).splitlines())


def _begun(line: str) -> str:
    """A line that begins as plain text."""
    return _BEGINS.sub(r"\1\\\2", line)
