"""What there is to say about a store: read from its metadata, its marks and what failed; no number is read."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from sonarsynth.conventions import PINGS
from sonarsynth.store import Folder, Remote, beside, must_be_store, root_attributes
from sonarsynth.store.files.json_lines import read_lines
from sonarsynth.store.files.place import FileRecord, read_json
from sonarsynth.store.marks import Damage, Mark, load_layout, load_marks, marked


@dataclass(frozen=True)
class Array:
    """One array as its metadata describes it."""

    path: str  # such as image/energy
    dims: tuple[str, ...]
    shape: tuple[int, ...]
    dtype: str  # as Zarr names it
    attributes: Mapping[str, Any]

    @property
    def framed(self) -> bool:
        """True where there is an entry for each frame."""
        return self.dims[:1] == ("frame",)

    @property
    def units(self) -> str:
        """Units, "" where it has none."""
        return str(self.attributes.get("units", ""))

    @property
    def meaning(self) -> str:
        """What it is, in a few words."""
        return str(self.attributes.get("long_name", ""))

    @property
    def group(self) -> str:
        """The group that it is in, "" for the root."""
        return self.path.rpartition("/")[0]

    @property
    def kind(self) -> str:
        """One of: text, number, whole number, yes or no."""
        if self.dtype.startswith(("int", "uint")):
            return "number" if "scale_factor" in self.attributes else "whole number"
        return {"float": "number", "bool": "yes or no"}.get(self.dtype.rstrip("0123456789"), "text")


@dataclass(frozen=True)
class Facts:
    """A store, as a card describes it."""

    name: str  # of the folder
    attributes: Mapping[str, Any]  # of the root
    arrays: tuple[Array, ...]  # in the order of their paths
    laid_out: Mapping[str, FileRecord]  # files that no frame changes
    url: str  # of a store that has one
    complete: int  # frames that are there
    files: int
    bytes: int
    failed: Mapping[str, int]  # frames that failed, by what went wrong
    mixed: Mapping[str, int]  # frames made with other libraries than the rest, by these

    @property
    def frames(self) -> int:
        """Frames of the whole dataset."""
        return next((a.shape[0] for a in self.arrays if a.framed), 0)

    @property
    def plan(self) -> Mapping[str, Any]:
        """The plan as the store has it; {} in a store of an earlier version."""
        return mapping_of(self.attributes.get("plan"))

    @property
    def dataset(self) -> Mapping[str, Any]:
        """Whose it is, and how to cite it."""
        return mapping_of(self.attributes.get("dataset"))

    @property
    def provenance(self) -> Mapping[str, Any]:
        """How the store was begun."""
        return mapping_of(self.attributes.get("provenance"))

    @property
    def created(self) -> str:
        """When the store was begun, ISO 8601; "" where it is not known."""
        return str(self.provenance.get("created", ""))

    @property
    def title(self) -> str:
        """Title, in one line."""
        return " ".join(str(self.attributes.get("title", self.name)).split())

    @property
    def citation(self) -> str:
        """How to cite the dataset: as its makers want it, or made of what is known."""
        own = str(self.dataset.get("citation", ""))
        if own:
            return own
        people = ", ".join(str(mapping_of(c).get("name", "")) for c in self.dataset.get("creators", ()))
        year = f" ({self.created[:4]})" if self.created else ""
        dated = f"{people or 'Anonymous'}{year}. {self.title}, version {self.dataset.get('version', '1.0.0')}."
        tool = f"Made with sonarsynth {self.attributes.get('sonarsynth_version', '')}".rstrip() + "."
        return " ".join(sentence for sentence in (dated, tool, str(self.dataset.get("url", ""))) if sentence)

    @property
    def lit_by(self) -> tuple[str, ...]:
        """What makes the sound whose echoes are heard."""
        named = self.attributes.get("lit_by")
        return tuple(map(str, named)) if isinstance(named, list) else ("snapping shrimp",)

    @property
    def sonar(self) -> str:
        """Whether it makes that sound itself."""
        return "active sonar" if PINGS in self.lit_by else "passive sonar"

    @property
    def summary(self) -> str:
        """What the dataset is, in the words of its makers or in one sentence of ours."""
        own = str(self.dataset.get("description", ""))
        if own:
            return own
        sizes = mapping_of(self.plan.get("sizes"))
        phrases = [f"{self.frames} frames"]
        if self.plan.get("sequences"):
            phrases.append(f"in {self.plan['sequences']} sequence{'s' * (self.plan['sequences'] != 1)}")
        if sizes.get("sensor"):
            phrases.append(f"of an array of {sizes['sensor']} hydrophones")
        light = " and ".join(self.lit_by)
        return (
            f"Synthetic {self.sonar} that is lit by {light}: {' '.join(phrases)}, simulated, each with the truth that "
            "made it: where targets and sources are, what each beam meets, and a link budget of levels."
        )


def facts_of(store: Folder) -> Facts:
    """Read what there is to say. Raises Mismatch where there is no store of ours, Damage where it cannot be read."""
    must_be_store(store)
    complete = files = size = 0
    mixed: Counter[str] = Counter()
    layout = load_layout(store)
    records = {} if layout is None else dict(layout.files)
    for _, mark in load_marks(store, marked(store)):
        if isinstance(mark, Mark):
            complete += len(mark.frames)
            sizes = [bytes_ for bytes_, _ in mark.files.values() if bytes_ >= 0]
            files += len(sizes)
            size += sum(sizes)
            others = mapping_of(mark.attributes.get("versions"))
            if others:
                mixed[", ".join(f"{name} {number}" for name, number in others.items())] += len(mark.frames)
    return Facts(
        name=store.name,
        url=str(store) if isinstance(store, Remote) else "",
        attributes=root_attributes(store),
        arrays=_arrays(store),
        laid_out=records,
        complete=complete,
        files=files + len(records),
        bytes=size + sum(bytes_ for bytes_, _ in records.values()),
        failed=_failed(store),
        mixed=mixed,
    )


def _arrays(store: Folder) -> tuple[Array, ...]:
    try:
        members = read_json(store, "zarr.json")["consolidated_metadata"]["metadata"]
        arrays = [
            Array(
                path, tuple(m.get("dimension_names") or ()), tuple(m["shape"]), _type(m["data_type"]), m["attributes"]
            )
            for path, m in members.items()
            if m["node_type"] == "array"
        ]
    except (KeyError, TypeError, AttributeError):
        raise Damage(f"{store}: zarr.json is missing or damaged: 'sonarsynth repair' restores it") from None
    return tuple(sorted(arrays, key=lambda a: (a.group, a.path)))


def _type(name: Any) -> str:
    return str(name["name"] if isinstance(name, dict) else name)


def _failed(store: Folder) -> dict[str, int]:
    """Frames that failed, counted by the kind of what went wrong."""
    last: dict[int, str] = {}
    for row in read_lines(beside(store, "failed.jsonl")):
        with suppress(ValueError, KeyError, TypeError):
            last[int(row["frame"])] = f"{row['stage']}: {str(row['error']).partition(':')[0]}"
    return dict(Counter(last.values()))


def mapping_of(value: Any) -> Mapping[str, Any]:
    """What a store says, where it is a mapping; nothing where it is not."""
    return value if isinstance(value, Mapping) else {}
