"""The card that programs read: Croissant 1.0, JSON-LD (MLCommons, Croissant format specification, 2024).

Croissant 1.0 has no word for an array of a Zarr store. So the files of the store are one FileSet, and an array is a
column of it: a field of the record set `frames`, with a record a frame, where it has a frame axis, and else of `fixed`;
dimensions and units stand in the descriptions. The metadata of the store are a FileObject with a digest; the marks in
the store have those of all other files.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from sonarsynth.products import SPLITS
from sonarsynth.store.cards.facts import Array, Facts

TERMS: Final = (
    "citeAs column equivalentProperty extract field fileObject fileProperty fileSet format includes "
    "isLiveDataset jsonPath key md5 parentField path recordSet references regex repeated replace "
    "samplingRate separator source subField transform"
)
"""Terms of Croissant, each under its own name."""

CONTEXT: Final[Mapping[str, Any]] = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    **{name: f"cr:{name}" for name in TERMS.split()},
    "conformsTo": "dct:conformsTo",
    "cr": "http://mlcommons.org/croissant/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "rai": "http://mlcommons.org/croissant/RAI/",
    "sc": "https://schema.org/",
}
"""The context of appendix 1 of the specification."""

KEYWORDS: Final = ("underwater acoustics", "synthetic data", "simulation")
ZARR: Final = "application/vnd.zarr"
_TYPES: Final = {"number": "sc:Float", "whole number": "sc:Integer", "yes or no": "sc:Boolean", "text": "sc:Text"}
_SPLIT_URLS: Final = {name: f"cr:{name.capitalize()}Split" for name in (*SPLITS, "training")} | {
    "train": "cr:TrainingSplit"
}


def croissant(facts: Facts) -> dict[str, Any]:
    """The Croissant metadata of a store. Addresses of files are relative to the folder that the store is in.

    What its makers did not say: the creator is sonarsynth, the address is that of the store beside this file, and the
    date of publication is that on which the store was begun.
    """
    dataset, created = facts.dataset, facts.created[:10]
    metadata = {
        "@context": dict(CONTEXT),
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.0",
        "name": facts.title,
        "description": facts.summary,
        "license": _licence(str(facts.attributes.get("licence", ""))),
        "url": _address(dataset.get("url")) or facts.url or f"./{facts.name}",
        "creator": _creators(facts),
        "datePublished": created or "1970-01-01",
        "dateCreated": facts.created,
        "version": str(dataset.get("version", "1.0.0")),
        "citeAs": facts.citation,
        "keywords": list(
            dict.fromkeys([*map(str, dataset.get("keywords", ())), facts.sonar, *facts.lit_by, *KEYWORDS])
        ),
        "isLiveDataset": False,
        "inLanguage": "en",
        "distribution": [*_objects(facts), _files(facts)],
        "recordSet": [*_split_set(facts), *_records(facts)],
    }
    return {name: value for name, value in metadata.items() if value not in ("", [])}


def _address(url: Any) -> str:
    """An address of a page; "" for what does something else where it is followed."""
    return str(url) if str(url).partition("://")[0] in ("https", "http") else ""


def _licence(text: str) -> str:
    """An identifier of SPDX as its address, anything else as it is."""
    plain = text.replace("-", "").replace(".", "").replace("+", "")
    return f"https://spdx.org/licenses/{text}.html" if plain.isalnum() and plain.isascii() else text


def _creators(facts: Facts) -> list[dict[str, Any]]:
    unnamed = f"unnamed, with sonarsynth {facts.attributes.get('sonarsynth_version', '')}".rstrip()
    creators = facts.dataset.get("creators") or [{"name": unnamed, "organisation": True}]
    entries = []
    for creator in creators:
        entry = {
            "@type": "sc:Organization" if creator.get("organisation") else "sc:Person",
            "name": creator.get("name", ""),
            "url": _address(creator.get("url")),
        }
        if creator.get("affiliation"):
            entry["affiliation"] = {"@type": "sc:Organization", "name": creator["affiliation"]}
        entries.append({name: value for name, value in entry.items() if value})
    return entries


def _objects(facts: Facts) -> Iterator[dict[str, Any]]:
    """The metadata of the store, which lead to all the rest."""
    if "zarr.json" in facts.laid_out:
        size, digest = facts.laid_out["zarr.json"]
        yield {
            "@type": "cr:FileObject",
            "@id": "metadata",
            "name": "zarr.json",
            "description": f"Metadata of all arrays and the provenance. The folder that it is in, {facts.name}, is the "
            "Zarr 3 store, which xarray.open_datatree opens.",
            "contentUrl": f"{facts.name}/zarr.json",
            "contentSize": f"{size} B",
            "encodingFormat": "application/json",
            "sha256": digest,
        }


def _files(facts: Facts) -> dict[str, Any]:
    return {
        "@type": "cr:FileSet",
        "@id": "store",
        "name": facts.name,
        "description": f"The Zarr 3 store: {facts.files} files, {facts.bytes} bytes. A column is an array.",
        "encodingFormat": ZARR,
        "includes": f"{facts.name}/**",
    }


def _split_set(facts: Facts) -> Iterator[dict[str, Any]]:
    if any(array.path == "split" for array in facts.arrays):
        fields = (
            ("number", "sc:Integer", "Its number in the array `split`."),
            ("name", "sc:Text", "Its name."),
            ("url", "sc:URL", "What it is for."),
        )
        yield {
            "@type": "cr:RecordSet",
            "@id": "splits",
            "name": "splits",
            "description": "The splits; each holds whole sequences.",
            "dataType": "cr:Split",
            "key": {"@id": "splits/number"},
            "field": [
                {"@type": "cr:Field", "@id": f"splits/{name}", "name": name, "description": text, "dataType": kind}
                for name, kind, text in fields
            ],
            "data": [
                {"splits/number": number, "splits/name": name, "splits/url": _SPLIT_URLS[name]}
                for number, name in enumerate(SPLITS)
            ],
        }


def _records(facts: Facts) -> Iterator[dict[str, Any]]:
    texts = {
        "frames": f"A record a frame, {facts.frames} in all, of which {facts.complete} are there: what is simulated, "
        "and the truth.",
        "fixed": "What is the same for all frames: axes, positions in the array, meshes.",
    }
    for name, text in texts.items():
        arrays = [array for array in facts.arrays if array.framed == (name == "frames")]
        if arrays:
            fields = [_field(name, array) for array in arrays]
            yield {"@type": "cr:RecordSet", "@id": name, "name": name, "description": text, "field": fields}


def _field(records: str, array: Array) -> dict[str, Any]:
    inner = list(zip(array.dims, array.shape, strict=True))[records == "frames" :]
    shape = f" ({', '.join(f'{dim} {size}' for dim, size in inner)})" if inner else ""
    packed = f" Stored as {array.dtype} with a scale factor." if "scale_factor" in array.attributes else ""
    units = f", in {array.units}" if array.units not in ("", "1") else ""
    field: dict[str, Any] = {
        "@type": "cr:Field",
        "@id": f"{records}/{array.path}",
        "name": array.path,
        "description": f"{array.meaning or array.path}{units}{shape}; {array.dtype}.{packed}",
        "dataType": _TYPES[array.kind],
        "source": {"fileSet": {"@id": "store"}, "extract": {"column": array.path}},
    }
    if inner:
        field["repeated"] = True
    if (records, array.path) == ("frames", "split"):
        field["references"] = {"field": {"@id": "splits/number"}}
    return field
