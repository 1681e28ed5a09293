"""Populations: none and five hundred bodies, a region without room, tables of meshes that are none."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from sonarsynth.pipeline import render
from sonarsynth.planning import plan
from sonarsynth.recipe import Recipe, reading
from sonarsynth.recipe.populations.population import BodyModel, Population
from sonarsynth.recipe.populations.regions import BoxRegion
from sonarsynth.targets.shapes import Sphere
from sonarsynth.validation.extremes.extreme_chains import recipe
from sonarsynth.validation.extremes.outcomes import Case, CaseResult, holds, refused, together

BALLS = (BodyModel(shape=Sphere(radius=0.1, edge=0.1)),)
SEA = BoxRegion(low=(5.0, -30.0, -39.0), high=(65.0, 30.0, -1.0))


def _with(population: Population) -> Recipe:
    scene = recipe().scene
    return replace(recipe(), scene=replace(scene, world=replace(scene.world, populations=(population,))))


def _none_and_many() -> CaseResult:
    """A frame of no body, where there is room for 500, and a sequence of all of them."""
    none = _with(Population(name="ball", models=BALLS, most=500, region=SEA, weights=(1.0, *[0.0] * 500)))
    tree = render(plan(none, ("image",)), 0)
    truth = tree["truth/targets"].dataset
    bodies = _with(Population(name="ball", models=BALLS, least=500, most=500, region=SEA)).frame(0)[1].moment.bodies
    centre = np.array([body.pose.position for body in bodies])
    apart = np.linalg.norm(centre[:, None] - centre[None], axis=2) + 1e3 * np.eye(len(centre))
    return together(
        holds(
            truth.sizes["target"] == 500 and not truth["present"].values.any() and (truth["mesh"].values == -1).all(),
            "500 targets that are missing in a frame of none",
        ),
        holds(bool(np.isfinite(tree["image"].dataset["energy"].values).all()), "its image is one of silence"),
        holds(
            len(bodies) == 500 and float(apart.min()) > 0.2, f"500 balls, {apart.min():.2g} m apart where 0.2 m touch"
        ),
    )


def _no_room() -> CaseResult:
    small = BoxRegion(low=(10.0, 0.0, -10.0), high=(10.3, 0.3, -9.7))
    crowd = _with(Population(name="ball", models=BALLS, least=50, most=50, region=small))
    return refused(lambda: plan(crowd), "no room for body")


def _broken() -> CaseResult:
    """Of a folder of meshes one is empty, one is no mesh, one is missing; and a table that is none."""
    yaml = reading.dump(_with(Population(name="ball", models=BALLS, most=1, region=SEA)))
    head, _, rest = yaml.partition("models:")
    indent = head.rpartition("\n")[2]
    text = f"{head}models: {{table: hulls/all.csv}}\n{indent}least:{rest.partition('least:')[2]}"
    parts = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "hulls").mkdir()
        (folder / "hulls/empty.stl").touch()
        (folder / "hulls/text.obj").write_text("no mesh\n")
        (folder / "r.yaml").write_text(text)
        for row, words in (
            ("file\nempty.stl", "empty.stl"),
            ("file\ntext.obj", "text.obj"),
            ("file\nnone.stl", "no such file"),
            ("file,weight\nempty.stl,much", "must be a plain number"),
            ("file,shape\nempty.stl,ball", "'shape' is no column"),
            ("file", "lists no model"),
            ("\x00\xff", "is no column"),
        ):
            (folder / "hulls/all.csv").write_text(row)
            parts.append(refused(lambda: plan(reading.load(folder / "r.yaml")), words))
    return together(parts)


CASES = (
    Case("no body, and 500 bodies", "missing in their slots; drawn, and none in another", _none_and_many),
    Case("a region without room", "refused in one line that names the population", _no_room),
    Case("a table of broken meshes", "each refused in one line", _broken),
)
