"""What a recipe spans: a draw belongs to its sequence, whatever else there is and in whatever order it is asked for."""

from __future__ import annotations

import json
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import chisquare, kstest, norm, spearmanr
from scipy.stats.qmc import discrepancy

from sonarsynth.description import FieldError
from sonarsynth.environment.sea import Environment, Isovelocity
from sonarsynth.geometry.motion import ConstantVelocity, Line, pose, velocity
from sonarsynth.recipe import Axis, Choice, Integers, LogUniform, Normal, Recipe, Sobol, Uniform, Zip, reading
from sonarsynth.recipe.scene import Scene, Trajectory, World
from sonarsynth.recipe.sequence_checks import check_spanned
from sonarsynth.recipe.variation.random_variations import Condition
from sonarsynth.recipe.varied_columns import columns
from sonarsynth.sources.shrimp import SnappingShrimp
from sonarsynth.targets.shapes import Box, Sphere
from sonarsynth.targets.target import Target

MOTION = "scene.world.targets.0.motion"
SHRIMP = "scene.world.sources.0.position"


def recipe(**more: Any) -> Recipe:
    world = World(
        environment=Environment(depth=20.0, sound_speed=Isovelocity(speed=1500.0)),
        targets=(
            Target(name="body", shape=Sphere(radius=0.5), motion=ConstantVelocity(start=(10.0, 0.0, -7.0), speed=1.0)),
        ),
        sources=(SnappingShrimp(position=(20.0, 0.0)),),
    )
    return Recipe(**({"seed": 5, "scene": Scene(world=world, trajectory=Trajectory(frames=3))} | more))


RANGES = Axis(path=f"{MOTION}.start.0", values=("10 m", "1200 cm", 15))
HEADINGS = Axis(path=f"{MOTION}.heading", first="0 deg", last="270 deg", step="90 deg", name="heading")
DRAWN = (
    Uniform(path=f"{SHRIMP}.0", low="18 m", high="25 m"),
    Normal(path=f"{MOTION}.start.2", mean=-7.0, deviation=2.0, low=-9.0, high=-5.0),
    Choice(path=f"{MOTION}.speed", values=("1 m/s", "2 kn"), weights=(3.0, 1.0)),
    Sobol(path=f"{SHRIMP}.1", low=-5.0, high=5.0),
    Sobol(path="scene.world.environment.depth", low="20 m", high="30 m"),
)


def by_content(of: Recipe) -> dict[str, str]:
    """Of each point and repeat: everything that its frames are made from."""
    spanned, made = of.spanned, {}
    for n in range(of.sequences):
        point = sorted((s.paths, s.value.text) for s in spanned.grid_settings(n))
        frame = of.frame(of.first_frame(n) + 1)[1]
        made[str((point, spanned.point(n)[-1]))] = f"{of.scene_of(n)} {frame.key} {frame.moment.snaps}"
    return made


def test_the_grid_is_every_combination_and_the_last_changes_fastest() -> None:
    made = recipe(grid=(RANGES, HEADINGS), repeats=2)
    assert (made.sequences, made.frames) == (24, 72)
    seen = [
        (s.world.targets[0].motion.start[0], s.world.targets[0].motion.heading) for s in map(made.scene_of, range(24))
    ]
    expected = [(x, h) for x in (10.0, 12.0, 15.0) for h in np.deg2rad([0, 90, 180, 270]) for _ in range(2)]
    assert np.allclose(seen, expected, rtol=1e-15)
    scene, frame = made.frame(3 * 23 + 2)
    assert (frame.trajectory, frame.step, frame.index) == (23, 2, 71)
    assert scene.sonar is made.scene.sonar
    with pytest.raises(IndexError, match=r"outside 0\.\.71"):
        made.frame(72)


def test_ranges_end_where_they_say() -> None:
    def taken(**parts: Any) -> list[Any]:
        return [plain.value for plain in Axis(path=f"{MOTION}.speed", **parts).taken]

    assert taken(first=0.0, last=0.3, step=0.1) == [0.0, 0.1, 0.2, 0.3]
    assert taken(first=1, last=4, step=2) == [1, 3]
    assert taken(first="3 kn", last="1 kn", step="-1 kn") == ["3.0 kn", "2.0 kn", "1.0 kn"]
    assert taken(first="0 m/s", last="1 m/s", count=5) == [f"{n} m/s" for n in (0.0, 0.25, 0.5, 0.75, 1.0)]


def test_zipped_entries_advance_together() -> None:
    shapes = Axis(
        path="scene.world.targets.0.shape", values=(Sphere(radius=0.3), Box(size=(1, 1, 1)), {"kind": "remus100"})
    )
    made = recipe(grid=(Zip(zip=(RANGES, shapes)),))
    targets = [made.scene_of(n).world.targets[0] for n in range(3)]
    assert [(t.motion.start[0], t.shape.kind) for t in targets] == [(10, "sphere"), (12, "box"), (15, "remus100")]


def test_several_fields_can_get_the_same_value() -> None:
    made = recipe(grid=(Axis(path=[f"{MOTION}.start.0", f"{SHRIMP}.0"], values=(9.0,)),))
    world = made.scene_of(0).world
    assert world.targets[0].motion.start[0] == world.sources[0].position[0] == 9.0


def test_no_order_changes_a_draw() -> None:
    made, again = (recipe(grid=(RANGES, HEADINGS), variations=DRAWN, repeats=3) for _ in range(2))
    numbers = list(range(made.sequences))
    forward = {n: str(made.scene_of(n)) for n in numbers}
    random.Random(1).shuffle(numbers)
    assert {n: str(again.scene_of(n)) for n in numbers[:20]} == {n: forward[n] for n in numbers[:20]}
    assert len(set(forward.values())) == made.sequences


@pytest.mark.parametrize(
    "more",
    [
        {"repeats": 4},
        {"grid": (Axis(path=f"{MOTION}.start.0", values=("8 m", 15, "10 m", 9.0, "1200 cm")), HEADINGS)},
        {"grid": (HEADINGS, RANGES)},
        {"splits": {"train": 0.5, "test": 0.5}},
    ],
    ids=["more repeats", "more values, elsewhere", "entries in another order", "splits"],
)
def test_more_sequences_change_none_of_those_there(more: dict[str, Any]) -> None:
    """Their scenes, snaps and the key of all that is random in them; numbers may change."""
    there = {"grid": (RANGES, HEADINGS), "variations": DRAWN, "repeats": 2}
    before, after = by_content(recipe(**there)), by_content(recipe(**(there | more)))
    assert before.items() <= after.items()


def test_one_variation_more_changes_none_of_the_others() -> None:
    few, many = recipe(variations=DRAWN[:4], repeats=5), recipe(variations=DRAWN, repeats=5)
    for n in range(5):
        assert few.spanned.drawn(n) == many.spanned.drawn(n)[:4]


def test_another_seed_is_another_dataset() -> None:
    one, other = recipe(variations=DRAWN, repeats=20), recipe(variations=DRAWN, repeats=20, seed=6)
    assert all(one.scene_of(n) != other.scene_of(n) for n in range(20))


def test_a_recipe_without_a_grid_is_its_scene() -> None:
    made = recipe()
    assert made.scene_of(0) is made.scene and made.frames == 3
    assert made.frame(2)[1].key == 0


def test_a_path_that_was_renamed_draws_the_numbers_of_its_first_name() -> None:
    across, height = ("scene.world.sources.0.position.1", "scene.world.sources.0.height")
    along = Uniform(name="x", path=(SHRIMP + ".0",), low="4 m", high="9 m")
    up = Sobol(name="h", path=(height,), low="0 m", high="1 m")
    spanned = recipe(seed=4, grid=(Axis(path=(across,), values=(-5, -6)),), variations=(along, up)).spanned
    values = [float(str(s.value.value).removesuffix(" m")) for n in range(2) for s in spanned.drawn(n)]
    first = [6.286896010179364, 0.19604593887925148, 8.067603436455116, 0.6183403013274074]  # by version 0.1
    np.testing.assert_allclose(values, first, rtol=1e-9)


def drawn(variation: Any, count: int = 4000) -> np.ndarray:
    made = recipe(variations=(variation,), repeats=count)
    values = [made.spanned.drawn(n)[0].value.value for n in range(count)]
    return np.array([float(str(v).split()[0]) for v in values])


def test_draws_have_their_distributions() -> None:
    assert kstest(drawn(DRAWN[0]), "uniform", (18, 7)).pvalue > 0.01
    cut = norm(-7, 2)
    low, high = cut.cdf([-9, -5])
    values = drawn(DRAWN[1])
    assert values.min() >= -9 and values.max() <= -5
    assert kstest(values, lambda x: (cut.cdf(x) - low) / (high - low)).pvalue > 0.01
    assert kstest(drawn(Normal(path=f"{SHRIMP}.0", mean="3 m", deviation="2 m")), norm(3, 2).cdf).pvalue > 0.01
    assert np.mean(drawn(DRAWN[2]) == 1.0) == pytest.approx(0.75, abs=4 * np.sqrt(0.75 * 0.25 / 4000))


def test_logarithms_and_whole_numbers_are_drawn_evenly() -> None:
    values = drawn(LogUniform(path=f"{SHRIMP}.0", low="0.01 m", high="10 m"))
    assert kstest(np.log10(values), "uniform", (-2, 3)).pvalue > 0.01
    whole = drawn(Integers(path="scene.world.populations.0.least", low=-2, high=3))
    counts = [np.sum(whole == n) for n in range(-2, 4)]
    assert sum(counts) == len(whole) and chisquare(counts).pvalue > 0.01


def test_one_variation_goes_with_another_and_keeps_its_distribution() -> None:
    """Rank correlation of a Gaussian copula: Spearman's is (6/pi) arcsin(rho/2) (Kruskal, 1958)."""
    one = Uniform(path=f"{SHRIMP}.0", name="one", low=18, high=25)
    for rho in (-1.0, -0.5, 0.8, 1.0):
        other = LogUniform(path=f"{MOTION}.speed", low=0.1, high=10, like="one", correlation=rho)
        made = recipe(variations=(one, other), repeats=2000).spanned
        rows = np.array([[float(s.value.value) for s in made.drawn(n)] for n in range(2000)])
        assert spearmanr(*rows.T).statistic == pytest.approx(6 / np.pi * np.arcsin(rho / 2), abs=0.05)
        assert kstest(np.log10(rows[:, 1]), "uniform", (-1, 2)).pvalue > 0.01
        alone = recipe(variations=(one,), repeats=2000).spanned
        assert [made.drawn(n)[0].value for n in range(50)] == [alone.drawn(n)[0].value for n in range(50)]


def test_a_condition_is_kept_and_where_it_does_not_hold_the_field_stays() -> None:
    """A radius of what is drawn to be a ball; of boxes there is none, and the column says so."""
    ball, box = {"kind": "sphere", "radius": "0.5 m"}, {"kind": "box", "size": [1, 1, 1]}
    made = recipe(
        variations=(
            Choice(path="targets.body.shape", name="shape", values=(box, ball)),
            Uniform(
                path="targets.body.shape.radius",
                name="radius",
                low="0.1 m",
                high="0.4 m",
                when=Condition(entry="shape", value="sphere"),
            ),
        ),
        repeats=40,
    )
    check_spanned(made.spanned)
    radius = next(column for column in columns(made.spanned) if column.name == "radius")
    for n in range(40):
        shape = made.scene_of(n).world.targets[0].shape
        if isinstance(shape, Sphere):
            assert shape.radius == radius.values[n] and 0.1 <= shape.radius <= 0.4
        else:
            assert np.isnan(radius.values[n])
    assert 5 < np.isnan(radius.values).sum() < 35 and radius.attributes["units"] == "m"


def test_paths_go_by_name_and_draw_what_they_draw_by_number() -> None:
    numbered, named = (
        recipe(variations=(Uniform(path=path, name="x", low=18, high=25),), repeats=3)
        for path in (f"{MOTION}.start.0", "targets.body.motion.start.0")
    )
    assert [numbered.scene_of(n) for n in range(3)] == [named.scene_of(n) for n in range(3)]
    with pytest.raises(FieldError, match="is called 'bodi'; known: body"):
        _ = recipe(variations=(Uniform(path="targets.bodi.motion.speed", low=1, high=2),)).spanned


@pytest.mark.parametrize(
    ("variations", "message"),
    [
        ((Uniform(path=f"{SHRIMP}.0", low=1, high=2, like="x"),), "'x' is no other variation to go with: none"),
        (
            (Uniform(path=f"{SHRIMP}.0", low=1, high=2, when=Condition(entry="x", value=1)),),
            "'x' is no entry of the grid, nor a choice that comes before; known: there are none",
        ),
    ],
    ids=["like nothing", "when nothing"],
)
def test_what_others_depend_on_must_be_there(variations: tuple[Uniform, ...], message: str) -> None:
    with pytest.raises(FieldError, match=message):
        check_spanned(recipe(variations=variations, repeats=2).spanned)


def test_a_far_tail_is_drawn_from_without_loss() -> None:
    """Beyond 6 deviations, where 1 - cdf is lost to rounding, on either side."""
    for sign in (1.0, -1.0):
        bound = {"low": 6.0} if sign > 0 else {"high": -6.0}
        values = sign * drawn(Normal(path=f"{SHRIMP}.0", mean=0, deviation=1, **bound), 2000)
        assert values.min() >= 6.0
        assert kstest(values, lambda x: 1.0 - norm.sf(x) / norm.sf(6.0)).pvalue > 0.01


def test_sobol_draws_cover_evenly_in_all_dimensions_together() -> None:
    """Every 1 of 256 draws in an interval of its own in each dimension, and in each square of 16 x 16; less uneven than
    chance."""
    made = recipe(variations=DRAWN, repeats=256)
    rows = [[s.value.value for s in made.spanned.drawn(n)[3:]] for n in range(256)]
    unit = np.array([[(y + 5.0) / 10.0, (float(z.split()[0]) - 20.0) / 10.0] for y, z in rows])
    assert all(len(set(np.floor(256 * column))) == 256 for column in unit.T)
    assert len({tuple(square) for square in np.floor(16 * unit)}) == 256
    chance = [discrepancy(np.random.default_rng(n).random((256, 2))) for n in range(20)]
    assert discrepancy(unit) < 0.2 * min(chance)


def test_what_varies_survives_yaml() -> None:
    made = recipe(
        grid=(
            RANGES,
            Zip(zip=(HEADINGS, Axis(path=f"{MOTION}.pitch", values=(0, "1 deg", "0.002 rad", "3 mrad")))),
        ),
        variations=DRAWN,
        repeats=2,
        splits={"train": 0.75, "test": 0.25, "stratify": "heading"},
    )
    again = reading.loads(reading.dump(made))
    assert again == made and hash(again) == hash(made) and again.digest == made.digest
    assert by_content(again) == by_content(made)


def test_the_digest_knows_the_files_of_the_grid_wherever_they_lie(tmp_path: Path) -> None:
    import shutil

    from sonarsynth.targets.meshes import mesh_of

    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
    mesh = mesh_of(Box(size=(1.0, 1.0, 1.0)))
    faces = "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in mesh.faces)
    (tmp_path / "a" / "hull.obj").write_text("".join(f"v {x} {y} {z}\n" for x, y, z in mesh.vertices) + faces)
    shutil.copy(tmp_path / "a" / "hull.obj", tmp_path / "b" / "hull.obj")

    def digest(folder: str) -> str:
        held = {"kind": "mesh_file", "path": str(tmp_path / folder / "hull.obj"), "unit": "m"}
        return recipe(grid=(Axis(path="scene.world.targets.0.shape", values=(held,)),)).digest

    assert digest("a") == digest("b")
    (tmp_path / "b" / "hull.obj").write_text("".join(f"v {2 * x} {y} {z}\n" for x, y, z in mesh.vertices) + faces)
    assert digest("a") != digest("b")


def test_a_course_is_a_line_by_heading_and_speed() -> None:
    course = ConstantVelocity(start=(1.0, 2.0, -9.0), heading=np.deg2rad(30.0), speed=2.0, climb=0.1)
    ahead = (1.0 + 2.0 * 5 * np.sin(np.deg2rad(30)), 2.0 + 2.0 * 5 * np.cos(np.deg2rad(30)), -8.5)
    line = Line(start=course.start, stop=ahead, duration=5.0, heading=course.heading)
    for time in (-3.0, 0.0, 7.5):
        assert pose(course, time).position == pytest.approx(pose(line, time).position, rel=1e-14)
        assert pose(course, time).orientation == pytest.approx(pose(line, time).orientation)
        assert velocity(course, time) == pytest.approx(velocity(line, time), rel=1e-13)


def test_keys_are_texts_that_say_what_they_are() -> None:
    key = recipe(grid=(RANGES,), repeats=2).spanned.key(3)
    values, repeat = str(key).rsplit(" ", 1)
    assert json.loads(values) == [[[f"{MOTION}.start.0"], '"1200 cm"']] and repeat == "1"
