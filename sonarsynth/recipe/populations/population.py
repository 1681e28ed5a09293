"""What a population is made of."""

from __future__ import annotations

from typing import Annotated

from annotated_types import Ge, Gt, Le, MaxLen, MinLen
from pydantic import Field, model_validator

from sonarsynth.conventions import NonNegativeMetres, Number
from sonarsynth.description import description
from sonarsynth.recipe.populations.drawn_tracks import AtRest, DrawnTrack, Orientation, Upright
from sonarsynth.recipe.populations.regions import Region
from sonarsynth.scattering import Scattering
from sonarsynth.targets.shapes import Shape
from sonarsynth.targets.target import Category, Name, Scale


@description
class BodyModel:
    """One of the bodies that a population draws from."""

    shape: Shape
    """What it looks like."""
    category: Category | None = None
    """What a detector is to call it; left out: the name of the population."""
    weight: Annotated[Number, Gt(0)] = 1.0
    """How often it is taken, relative to the others."""
    scale: tuple[Scale, Scale] = (1.0, 1.0)
    """Least and largest size over that of the shape, drawn evenly in the logarithm."""
    scattering: Scattering | None = None
    """How its bodies scatter, as of a target."""
    licence: str = ""
    """Licence of the mesh, where it is somebody's."""

    @model_validator(mode="after")
    def _check(self) -> BodyModel:
        if self.scale[0] > self.scale[1]:
            raise ValueError(f"scale must be the least and the largest: {self.scale[0]:g} to {self.scale[1]:g}")
        return self


@description
class Population:
    """Bodies whose number, kind, place, orientation and track are drawn for each sequence.

    They are targets `<name>_1` to `<name>_<most>`, of which the first so many are there. Draws are keyed by the seed,
    the sequence, the population and the body: what is added after a population changes none of its bodies.
    """

    name: Name
    """Of its group of meshes in the store; of its bodies with a number."""
    models: Annotated[tuple[BodyModel, ...], MinLen(1), MaxLen(1000)]
    """What bodies may be; `{table: models.csv}` reads them from a table of mesh files."""
    least: Annotated[int, Ge(0), Le(500)] = 0
    """Fewest bodies of a sequence."""
    most: Annotated[int, Ge(1), Le(500)]
    """Most bodies of a sequence: the store has room for so many."""
    weights: tuple[Annotated[Number, Ge(0)], ...] | None = None
    """How often there are `least`, `least + 1`, ... `most`, relative to each other; left out: equally often."""
    region: Region
    """Where they may be."""
    on_bottom: bool = False
    """Whether they lie on the bottom, by their lowest points, rather than where the region has them."""
    orientation: Orientation = Field(default_factory=Upright)
    """How they lie: at rest and straight ahead always, swinging about it, wandering at first."""
    track: DrawnTrack = Field(default_factory=AtRest)
    """How they move. They are where they were drawn in the middle of the sequence."""
    apart: NonNegativeMetres = 0.0
    """Least gap between the spheres round two bodies, and to the array, at any frame."""
    sobol: bool = False
    """Whether their number and the first places that are tried are spread over the repeats of a grid point more evenly
    than by chance (as `kind: sobol` of variations)."""
    clutter: bool = False
    """Whether they are clutter, which no detector is asked to find: what it reports there is a false alarm."""

    @model_validator(mode="after")
    def _check(self) -> Population:
        if self.least > self.most:
            raise ValueError(f"least must not be over most: {self.least} to {self.most}")
        if self.weights is not None:
            if len(self.weights) != self.most - self.least + 1:
                raise ValueError(
                    f"has {len(self.weights)} weights for {self.most - self.least + 1} numbers, "
                    f"{self.least} to {self.most}"
                )
            if not sum(self.weights) > 0.0:
                raise ValueError("weights must not all be 0")
        return self

    @property
    def slots(self) -> tuple[str, ...]:
        """Names of its bodies."""
        return tuple(f"{self.name}_{number}" for number in range(1, self.most + 1))

    def category(self, model: int) -> str:
        """What a body of this model is called."""
        return self.models[model].category or self.name
