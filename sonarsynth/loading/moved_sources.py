"""A frame with other sources: moved, louder, or of another pulse."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from sonarsynth.description import FieldError
from sonarsynth.pipeline import frame_tree, values_at
from sonarsynth.planning import PRODUCTS, Choices, Plan, choices_from, chosen_products, context_of, plan
from sonarsynth.planning.other_sources import plan_with
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.reading import RecipeError
from sonarsynth.recipe.sequences import name_of
from sonarsynth.sources import Source
from sonarsynth.store import Mismatch
from sonarsynth.store.checking.recipe_files import files_of, recipe_with
from sonarsynth.threads import in_one_thread
from sonarsynth.tracing.arrivals import trace_each

if TYPE_CHECKING:
    import xarray as xr

PATH = "scene.world.sources"
"""Of what is replaced, in a recipe."""


@in_one_thread
def with_sources(
    dataset: xr.DataTree | Recipe | Plan,
    frame: int,
    sources: Iterable[Source | tuple[Source, ...]],
    *,
    products: Iterable[str] | None = None,
    files: Path | str | None = None,
) -> list[xr.DataTree]:
    """Compute a frame of a dataset with each of some sources in the place of its own.

    All else stays as it is: bodies, water, sonar, the planner's choices, what is drawn at random. The way from the
    facets to the array is traced once for all of the sources: a source may be moved without tracing again where all
    rays are recorded. Of what moves, sources share it that meet it at about one place, as the accuracy allows. From
    each source to the facets all is computed anew: travel time, spreading, scattering, and what bodies hide.

    Parameters
    ----------
    dataset: a store as `open` gives it, a recipe, or the plan of one.
    frame: its number.
    sources: for each result a source, such as `SnappingShrimp(position=(8.0, -3.0))` (m), or several in a tuple.
    products: what results have besides the truth (default: those of the store or plan; of a recipe those of `plan`).
    files: folder of the files that the recipe in a store names.

    Returns
    -------
    For each choice of sources a tree as `render` gives it. Its window is its own: the shortest that holds its echoes.

    Raises
    ------
    FieldError for a source that is out of the water, in a body or among the hydrophones, whose pulse cannot be made, or
    from where sound bends more than the plan follows; IndexError for a frame that is not there; Mismatch for a store
    whose recipe cannot be followed.
    """
    resolved = _planned(dataset, products, files).at(frame)
    if not isinstance(sources, Iterable):
        raise TypeError(f"sources must be several, such as [SnappingShrimp(...)], not one {type(sources).__name__}")
    choices = [of if isinstance(of, tuple) else (of,) for of in sources]
    plans = [plan_with(resolved, frame, of) for of in choices]
    frames = [of.frame(frame) for of in plans]
    context, snaps = context_of(resolved, resolved.frame(frame)), [of.moment.snaps for of in frames]
    arrivals = trace_each(context, resolved.propagation, snaps)
    trees = []
    for own, of_frame, paths in zip(plans, frames, arrivals, strict=True):
        sized = replace(own, sizes=own.sizes | {"path": max(len(paths.delay), 1)})
        trees.append(_without_own_sources(sized, frame_tree(sized, frame, values_at(sized, of_frame, paths))))
    return trees


def _without_own_sources(own: Plan, tree: xr.DataTree) -> xr.DataTree:
    """The tree without what says which sources the recipe has: its digest, and what it varies of them."""
    varied = [name_of(entry) for _, entry in own.recipe.spanned.entries if any(p.startswith(PATH) for p in entry.path)]
    del tree.attrs["recipe_digest"]
    tree.dataset = tree.to_dataset(inherit=False).drop_vars(varied)
    return tree


def _planned(dataset: xr.DataTree | Recipe | Plan, products: Iterable[str] | None, files: Path | str | None) -> Plan:
    """The plan of a dataset, with these products."""
    if isinstance(dataset, Plan):
        chosen = dataset.products if products is None else chosen_products(products)
        return dataset if chosen == dataset.products else _plan_of(dataset.recipe, chosen, dataset.choices)
    if isinstance(dataset, Recipe):
        return _plan_of(dataset, chosen_products(PRODUCTS if products is None else products), None)
    if not hasattr(dataset, "attrs"):
        kind = type(dataset).__name__
        raise TypeError(f"sources are moved in a store as sonarsynth.open gives it, a recipe or a plan, not a {kind}")
    attrs = {str(name): value for name, value in dataset.attrs.items()}
    try:
        chosen = chosen_products(attrs["products"] if products is None else products)
        choices = choices_from(attrs["choices"])
        recipe = recipe_with(str(attrs["recipe"]), "the store", files_of(Path("the store"), attrs, files))
    except (KeyError, RecipeError, FieldError, OSError) as error:
        raise Mismatch(f"the recipe of the store cannot be followed any more: {error}") from None
    resolved = _plan_of(recipe, chosen, choices)
    if resolved.digest != attrs.get("recipe_digest"):
        raise Mismatch("a file that the recipe of the store names has changed since it was built")
    return resolved


@lru_cache(maxsize=4)
def _plan_of(recipe: Recipe, products: frozenset[str], choices: Choices | None) -> Plan:
    """Planning takes longer than a frame: what was asked for last is kept."""
    return plan(recipe, products, choices)
