"""Whose a dataset is, and how it wants to be cited: nothing of it changes a number."""

from __future__ import annotations

from typing import Annotated

from pydantic import StringConstraints

from sonarsynth.description import description

Text = Annotated[str, StringConstraints(strip_whitespace=True, max_length=20_000)]
Line = Annotated[str, StringConstraints(strip_whitespace=True, max_length=500, pattern=r"^[^\n\r]*$")]
Address = Annotated[str, StringConstraints(pattern=r"^(https?://[^\s\"<>]+)?$", max_length=2000)]


@description
class Creator:
    """Who made a dataset: a person, or an organisation."""

    name: Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=500, pattern=r"^[^\n\r]*$")]
    """As it is to be cited."""
    organisation: bool = False
    """True for an organisation, false for a person."""
    affiliation: Line = ""
    """Where that person works."""
    url: Address = ""
    """Home page, or ORCID (https://orcid.org/...)."""


@description
class Attribution:
    """What is said of a dataset beside its title and licence; it goes into the store, its card and its metadata."""

    description: Text = ""
    """What the dataset is for, in the words of its makers; left out: what the recipe spans."""
    creators: tuple[Creator, ...] = ()
    """In the order of a citation."""
    citation: Text = ""
    """How to cite it, plain or BibTeX; left out: made of creators, year, title, version and address."""
    url: Address = ""
    """Where it is published: a page or a DOI (https://doi.org/...)."""
    version: Annotated[str, StringConstraints(pattern=r"^\d+\.\d+\.\d+$")] = "1.0.0"
    """Version of the dataset, MAJOR.MINOR.PATCH."""
    keywords: tuple[Line, ...] = ()
    """By which the dataset is to be found."""
