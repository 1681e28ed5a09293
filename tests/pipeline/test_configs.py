"""The recipes in configs/, each as its users run it."""

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from sonarsynth import evaluation, planning, schedule
from sonarsynth.cli import app
from sonarsynth.cli.running import run
from sonarsynth.pipeline import follow_rays, render
from sonarsynth.planning import Plan
from sonarsynth.products import ORIGINS
from sonarsynth.recipe import reading
from sonarsynth.tracing.ray_fan import EVENTS
from tools.same_numbers import harbour

ROOT = Path(__file__).resolve().parents[2]
CONFIGS = ROOT / "configs"
REPORTED = {"range of points on target", "origin of points", "ranges useful", "snaps useful"}
"""Figures of `verify` that depend on the scene: what they must be for one is asked by its test."""
REAL = ROOT.parent / "shared" / "data"
needs_real_input = pytest.mark.skipif(not REAL.is_dir(), reason="the real cast and hull lie beside the repository")


FRAMES = {
    "remus.yaml": range(0, 64, 9),
    "reef.yaml": (10, 32, 50),
    "thermocline.yaml": (0, 9, 36, 63),
    "grid.yaml": (0, 5, 72, 77, 138, 143),  # ends of the first sequence, of one between, and of the last
    "harbour.yaml": (0, 8),
    "deep.yaml": (0, 15),
    "crowd.yaml": (9,),
    "ping.yaml": (31,),
    "survey.yaml": range(6),  # of three sequences
}
"""Frames of a recipe that are built; of others all."""
LONG = {"thermocline.yaml", "harbour.yaml"}
EVERY = [
    pytest.param(file.name, marks=[pytest.mark.long] if file.name in LONG else [])
    for file in sorted(CONFIGS.glob("*.yaml"))
]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The store of some frames of a shipped recipe, each built once."""
    folder = tmp_path_factory.mktemp("shipped")

    @cache
    def build(name: str) -> Path:
        sets: tuple[str, ...] = ("repeats=6",) if name == "survey.yaml" else ()
        if name == "harbour.yaml":
            sets = harbour.written(folder)
        made = _plan(name, *sets)
        report = schedule.build(made, folder / f"{name}.zarr", frames=FRAMES.get(name), workers=0)
        assert report.ok and report.written == len(FRAMES.get(name, range(made.sizes["frame"])))
        return folder / f"{name}.zarr"

    return build


@pytest.mark.parametrize("name", EVERY)
def test_every_shipped_recipe_builds_and_verifies(name: str, built: Callable[[str], Path]) -> None:
    store = built(name)
    assert run(app, ["verify", str(store)]) == 0
    with xr.open_datatree(store, engine="zarr") as tree:
        frames = list(FRAMES.get(name, range(tree.sizes["frame"])))
        energy = tree["image/energy"].values[frames]
        assert np.isfinite(energy).all() and (energy.max(axis=(1, 2)) > 0).all()
        assert (tree["cloud/count"].values[frames] > 0).all() or name == "survey.yaml"  # one may have no body in view
        assert ("remainder" in tree["image"]) == (
            name in ("tank.yaml", "survey.yaml")
        )  # what is clear of echoes is left alone


def test_no_point_of_the_crowd_comes_from_the_second_snap(built: Callable[[str], Path]) -> None:
    """It snaps 12 ms later, and its direct pulse and echoes are heard among the echoes of the first."""
    with xr.open_datatree(built("crowd.yaml"), engine="zarr") as tree:
        point = np.isfinite(tree["cloud/range"].values)
        assert point.sum() > 3
        clock = tree["source_estimates/emission"].values[:, :1]
        right = (tree["cloud/emission"].values == clock) & (tree["cloud/target"].values >= 0)
        assert right[point].all()


def test_the_echo_of_the_tank_is_ranged_through_the_direct_pulse(built: Callable[[str], Path]) -> None:
    """It comes 0.45 ms after the direct pulse, whose ringing lasts 0.5 ms."""
    ranges = _checks(built("tank.yaml"))["range of points on target"].numbers
    assert ranges["points"] >= 1 and ranges["median_m"] < 0.01
    with xr.open_datatree(built("tank.yaml"), engine="zarr") as tree:
        assert tree["image/remainder"].item() < 1e-6


def test_the_tank_without_the_echo_says_so() -> None:
    """Kept, the direct pulse hides the echo: no point is made of its edge, and the plan names frame, target, share."""
    made = _plan("tank.yaml", "scene.processing.direct_pulse=keep")
    (note,) = (line for line in made.warnings if "lost" in line)
    assert note.startswith("cylinder: 100 % of its echo") and note.endswith("is lost to the echo window in frame 0")
    assert not np.isfinite(render(made, 0)["cloud/range"].values).any()


@cache
def _plan(name: str, *sets: str) -> Plan:
    """A plan is made once, by whatever test: that of the thermocline takes as long as its frames."""
    return planning.plan(reading.load(CONFIGS / name, sets))


def _checks(store: Path) -> dict[str, evaluation.Check]:
    with xr.open_datatree(store, engine="zarr") as tree:
        return {c.name: c for c in evaluation.check(tree.load())}


def test_the_thesis_scene_is_imaged_ranged_and_located(built: Callable[[str], Path]) -> None:
    """Every ninth frame of the crossing, from the first to the last, by the numbers that the data set is built for."""
    made = _plan("remus.yaml")
    assert made.sizes["frame"] == 64 and made.sizes["sensor"] == 508
    assert made.sizes["azimuth"] == made.sizes["elevation"] == 101
    checks = _checks(built("remus.yaml"))
    assert all(check.ok for name, check in checks.items() if name not in REPORTED), checks
    assert checks["brightest beam on target"].numbers == {"hits": 8, "frames": 8, "ghosts": 0}
    ranges = checks["range of points on target"].numbers
    assert ranges["points"] >= 8 and ranges["median_m"] < 0.05 and ranges["share_within_3"] >= 0.99
    assert not any(check.warning for check in checks.values()) and not evaluation.warnings(built("remus.yaml"))
    with xr.open_datatree(built("remus.yaml"), engine="zarr") as tree:
        found = evaluation.points(tree, range(0, 64, 9))
        beam = evaluation.beam_width(tree) * found.true_range[found.judged]
        distance = tree["cloud/distance"].values[found.frame, found.row][found.judged]
    assert found.judged.mean() > 0.9 and (found.target == 0).all()  # nothing else is in the water
    assert (distance < beam).all() and np.median(distance) < 0.3 * beam.mean()


@pytest.mark.long
def test_ghosts_by_surface_and_bottom_are_imaged_where_the_truth_says(built: Callable[[str], Path]) -> None:
    """Some frames of the crossing over a thermocline, with every path of up to two bounces."""
    made = _plan("thermocline.yaml")
    assert made.sizes["frame"] == 64 and made.sizes["elevation"] == 129
    checks = _checks(built("thermocline.yaml"))
    assert all(check.ok for name, check in checks.items() if name not in REPORTED), checks
    brightest = checks["brightest beam on target"].numbers  # a glint by surface or bottom may outshine the target
    assert brightest["frames"] == brightest["hits"] + brightest["ghosts"] == 4 and brightest["hits"] >= 2
    with xr.open_datatree(built("thermocline.yaml"), engine="zarr") as tree:
        for frame in (9, 36, 63):
            energy, truth = tree["image/energy"][frame], tree["truth/targets"].dataset.isel(frame=frame, target=0)
            for family in ("surface", "bottom"):
                echo = truth.sel(family=family)
                elevation, azimuth = echo.echo_elevation.item(), echo.echo_azimuth.item()
                near = {"elevation": slice(elevation - 5, elevation + 5), "azimuth": slice(azimuth - 5, azimuth + 5)}
                peak = energy.sel(near).where(lambda e: e == e.max(), drop=True)
                assert abs(peak.elevation.item() - elevation) < 1.5
                assert abs(peak.azimuth.item() - azimuth) < 3.0  # the hull is up to 3.6 degrees long
                assert 10 * np.log10(peak.item() / energy.median().item()) > 15.0
        found = evaluation.points(tree, (9, 36, 63))
        elevation = tree["cloud/elevation"].values[found.frame, found.row]
        at = tree["truth/targets/echo_elevation"].values[found.frame, 0, found.family]
    ghosts = found.family > 0
    assert (found.target == 0).all() and ghosts.sum() > 5 and found.judged.sum() > 5
    lobe = found.origin == ORIGINS.index("main lobe")
    assert np.abs(elevation - at)[lobe].max() < 2.0  # a ghost is where its image is, a direct echo where the target is
    assert checks["range of points on target"].numbers["largest_m"] < 0.5


@pytest.mark.long
def test_of_two_snaps_the_clock_is_the_one_whose_echoes_stand_clear(tmp_path: Path) -> None:
    """The direct pulse of the far snap lies in the echo window of the near one, and not the other way."""
    made = _plan("crowd.yaml", "scene.processing.direct_pulse=keep")
    assert schedule.build(made, tmp_path / "crowd.zarr", frames=(0,), workers=0).ok
    checks = _checks(tmp_path / "crowd.zarr")
    assert checks["predicted range errors"].ok
    with xr.open_datatree(tmp_path / "crowd.zarr", engine="zarr") as tree:
        found = evaluation.points(tree, (0,))
        late = tree["cloud/delay"].values[found.frame, found.row]
        assert tree["source_estimates/emission"].values[0].tolist() == [1, 0]
    assert set(found.target.tolist()) == {0, 1, 2} and (found.emission == 1).all() and not found.strange.any()
    assert (late < 9.1e-3).all()


def test_a_grid_of_ranges_headings_and_hulls(built: Callable[[str], Path]) -> None:
    """Of its 24 sequences the first, the last and one between."""
    made = _plan("grid.yaml")
    assert (made.recipe.sequences, made.sizes["frame"]) == (24, 144) and made.looked_at == 144
    steps = made.recipe.steps(0)
    frames = [frame for n in (0, 12, 23) for frame in (n * steps, (n + 1) * steps - 1)]
    assert frames == list(FRAMES["grid.yaml"])
    checks = _checks(built("grid.yaml"))
    assert all(check.ok is not False for check in checks.values()), checks
    assert checks["brightest beam on target"].numbers["hits"] == len(frames)
    with xr.open_datatree(built("grid.yaml"), engine="zarr") as tree:
        root = tree.to_dataset().isel(frame=slice(0, None, steps))
        assert np.bincount(root.split.values[[0, 12, 23]], minlength=3).sum() == 3
        assert np.unique(root.start_range.values).tolist() == [10.0, 12.0, 15.0]
        meshes = set(tree["truth/targets/mesh"].values[frames, 0].tolist())
        assert len(tree["targets/body"].children) == 4 and len(meshes) == 3 and meshes < set(range(4))
        there = tree["truth/targets/position"].values[frames, 0]
        assert np.isfinite(there).all() and np.array_equal(there[::2, 2], tree.to_dataset().body_z.values[frames[::2]])


def test_each_image_of_the_boat_shows_what_it_is_for() -> None:
    """dB re the brightest beam: what is short beside what lasts, and what the grating lobes are worth."""

    def levels(kind: str) -> tuple[float, float]:
        """Of the ball, and of the brightest beam that is neither on it nor on the boat."""
        sets = (f"scene.processing.beamforming={{kind: {kind}}}", "scene.world.chorus.density=0")
        energy = render(_plan("boat.yaml", *sets), 1)["image/energy"]
        decibels = 10.0 * np.log10(np.maximum(energy / energy.max(), 1e-9))
        ball, boat = (
            (abs(energy.azimuth - azimuth) < 5.0) & (abs(energy.elevation - elevation) < 5.0)
            for azimuth, elevation in ((8.1, 0.0), (-6.3, 9.4))
        )
        assert float(decibels.where(boat).max()) == 0.0 or kind == "capon"
        return float(decibels.where(ball).max()), float(decibels.where(~(ball | boat)).max())

    echo, ghost = levels("focused")
    assert -15.0 < echo < -5.0 and -15.0 < ghost < -10.0
    assert levels("sub_band")[1] < ghost - 10.0
    assert levels("clean")[1] < ghost - 6.0
    assert levels("order_statistic")[0] < echo - 15.0


@pytest.mark.long
def test_levels_of_the_images_of_the_boat_are_those_of_the_page() -> None:
    """To the tenth of a dB that tools/docs/how-to/images.md has; with the chorus, whose draws are part of them."""
    page = (CONFIGS.parent / "tools/docs/how-to/images.md").read_text().partition("```")[0]
    rows = re.findall(r"^\| `(\w+)` \|.*\| (\S+) \| (\S+) \| (\S+) \|$", page, re.MULTILINE)
    assert len(rows) == 6
    for kind, *written in rows:
        energy = render(_plan("boat.yaml", f"scene.processing.beamforming={{kind: {kind}}}"), 1)["image/energy"]
        decibels = 10.0 * np.log10(np.maximum(energy / energy.max(), 1e-9))
        ball, boat = (
            decibels.where((abs(energy.azimuth - azimuth) < 5.0) & (abs(energy.elevation - elevation) < 5.0)).max()
            for azimuth, elevation in ((8.1, 0.0), (-6.3, 9.4))
        )
        ghost = decibels.sel(elevation=slice(-20.0, -10.0)).max()
        assert [float(level) for level in (ball, boat, ghost)] == pytest.approx([float(w) for w in written], abs=0.11)


def test_the_target_crosses_20_m_ahead_9_m_to_the_right() -> None:
    made = _plan("remus.yaml")
    places = [
        frame.sonar_pose.to_body(frame.moment.bodies[0].pose.position)
        for frame in (made.recipe.frame(0)[1], made.recipe.frame(63)[1])
    ]
    assert places[0][0] == pytest.approx(20.0) and places[1][0] == pytest.approx(20.0)
    assert places[1][1] - places[0][1] == pytest.approx(-9.0)  # starboard, which is drawn on the right


def test_three_rays_in_the_tank() -> None:
    """Figure 14: reflections from surface, bottom and cylinder; between them the Snell invariant holds."""
    rays = follow_rays(_plan("tank.yaml"), 0)
    events = [EVENTS[e] for e in rays.event]
    assert set(rays.ray) == {0, 1, 2}
    assert {"surface", "bottom", "facet"} <= set(events)
    assert rays.position[:, 2].max() <= 1e-12 and rays.position[:, 2].min() >= -0.3 - 1e-12
    profile = _plan("tank.yaml").profile
    invariant = np.hypot(*rays.direction[:, :2].T) / profile.at(-rays.position[:, 2])
    for ray, name in zip(range(3), ("surface", "facet", "bottom"), strict=True):
        mine = rays.ray == ray
        reflected = np.cumsum(np.array(events)[mine] == "facet")  # a facet turns the ray, and so the invariant
        for part in range(reflected.max() + 1):
            values = invariant[mine][reflected == part]
            assert values == pytest.approx(np.full_like(values, values[0]), rel=1e-12)
        assert name in np.array(events)[mine]


def test_rays_from_the_l_shape_go_on_to_the_shrimp() -> None:
    """Figure 15: from the first facet to (1, 10, -10), with a coefficient that falls off the mirror direction."""
    rays = follow_rays(_plan("l_shape.yaml"), 0)
    arrived = rays.event == EVENTS.index("arrival")
    assert arrived.sum() > 20
    assert rays.position[arrived] == pytest.approx(np.broadcast_to([1.0, 10.0, -10.0], (arrived.sum(), 3)), abs=1e-9)
    coefficient = rays.coefficient[np.isfinite(rays.coefficient)]
    assert coefficient.min() >= 0 and coefficient.max() <= 1 and np.ptp(coefficient) > 0.3


@pytest.mark.long
@needs_real_input
def test_real_water_and_a_real_hull(tmp_path: Path) -> None:
    made = _plan("harbour.yaml", *harbour.settings(REAL / "castaway_ctd.csv", REAL / "rexrov.stl"))
    report = schedule.build(made, tmp_path / "harbour.zarr", frames=range(0, 16, 5), workers=0)
    assert report.ok
    checks = _checks(tmp_path / "harbour.zarr")
    assert all(check.ok for name, check in checks.items() if name not in REPORTED), checks


def test_the_snap_is_drawn(tmp_path: Path) -> None:
    from sonarsynth.pictures.snap_pictures import snap as draw_snap

    draw_snap(reading.load(CONFIGS / "remus.yaml"), tmp_path / "pictures" / "snap.png")
    assert (tmp_path / "pictures" / "snap.png").read_bytes().startswith(b"\x89PNG")
