"""A method is added with one file and one name, as the page on extending says: it runs, and plan and store say so.

The files are those of the page. They are laid into a copy of the package whose other files are links to ours, so that
compiled kernels are shared; a frame is built by that copy in a process of its own.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "sonarsynth"
PAGE = (ROOT / "tools" / "docs" / "how-to" / "extending.md").read_text()
FILES = dict(re.findall(r"^```python file=(\S+)\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE))
UNIONS = {
    "imaging": "Beamformer",
    "ranging/picking": "Picking",
    "ranging/placing": "Placing",
    "signals": "Synthesis",
    "scattering": "Scattering",
    "environment/noise": "Noise",
    "propagation": "Tracing",
    "ranging/location": "Locator",
    "ranging/cancelling": "Cancelling",
    "sources": "Source",
    "environment/scatterers": "ScattererField",
    "scattering/boundaries": "BoundaryScattering",
    "detection": "Detector",
}
KINDS = (
    {
        "scene.processing.beamforming": "coherence_factor",
        "scene.processing.picking": "loudest",
        "scene.processing.placing": "monostatic",
    },
    {"scene.physics.synthesis": "whole_samples", "scene.physics.scattering": "power_cosine"},
    {
        "scene.world.environment.noise": "isotropic_noise",
        "scene.processing.locating": "surveyed_source, position: [0.6, -0.25, -0.3]",
        "scene.processing.cancelling": "time_gate, length: 10 ms",
    },
    {"scene.physics.tracing": "measured_current"},
    {"scene.world.scatterers": "surface_patch, centre: [1.1, 0.0], side: 0.2, pieces: 50, strength: -10 dB"},
    {"scene.world.reverberation.bottom": "lommel_seeliger"},
    {"scene.world.sources.0": "pinger, position: [0.6, -0.25, -0.3]"},
)
SCRIPT = """
import json, sys
import numpy as np
import sonarsynth as ss
from sonarsynth import schedule

assert ss.__file__.startswith(sys.argv[1]), ss.__file__
base = [f"scene.sonar.beams.{axis}=31" for axis in ("azimuths", "elevations")]
base += ["scene.sonar.array={kind: planar_lattice, columns: 8, rows: 6, pitch: 3 cm}", "scene.trajectory.frames=1"]
base += ["scene.world.targets.0.shape={kind: cylinder, radius: 6 cm, length: 30 cm, edge: 3 cm}"]  # exact sums are slow
said = {}
for which in json.loads(sys.argv[2]):
    sets = [f"{path}={{kind: {kind}}}" for path, kind in which.items() if not path.endswith("scatterers")]
    sets += [f"{path}=[{{kind: {kind}}}]" for path, kind in which.items() if path.endswith("scatterers")]
    plan = ss.plan(ss.load(sys.argv[3], base + sets))
    name = " ".join(kind.partition(",")[0] for kind in which.values()) or "usual"
    assert schedule.build(plan, f"{name}.zarr", workers=0).ok
    tree = ss.open(f"{name}.zarr")
    cloud = tree["cloud"].dataset.isel(frame=0)
    count = int(cloud["count"])
    said[name] = {
        "recipe": tree.attrs["recipe"],
        "rows": {row.stage: [row.method, row.error, row.seconds] for row in plan.stages},
        "choices": {name: tree.attrs["choices"][name] for name in ("beamforming", "picking", "placing", "synthesis")},
        "energy": np.asarray(tree["image/energy"][0]).tolist(),
        "delay": cloud["delay"].values[:count].tolist(),
        "range": cloud["range"].values[:count].tolist(),
        "pressure": np.asarray(tree["signals/pressure"][0, 0]).tolist(),
        "sensors": np.asarray(tree["signals/pressure"][0]).tolist(),
        "position": np.asarray(tree["signals/position"]).tolist(),
        "source": np.asarray(tree["source_estimates/position"][0, 0]).tolist(),
        "heard": float(tree["source_estimates/time"][0, 0]),
        "true": float(tree["truth/emissions/arrival"][0, 0]),
        "start": float(tree["signals/start"][0]),
        "meeting": float(tree["truth/targets/meeting_time"][0, 0, 0]),
    }
found = ss.detect("usual.zarr", "brightest_beam")
said["usual"]["found"] = [found.box[0].tolist(), float(found.score[0]), len(found)]
print(json.dumps(said))
"""


def extended(folder: Path) -> Path:
    """A copy of the package with the files of the page, and their names in the unions."""
    copy = folder / "sonarsynth"
    families = {name.rpartition("/")[0] for name in FILES}
    rooms = {"", *families, *(str(parent) for family in families for parent in Path(family).parents)} - {"."}
    for room in sorted(rooms):
        (copy / room).mkdir()
        for entry in (PACKAGE / room).iterdir():
            own = entry.relative_to(PACKAGE).as_posix() in rooms or (room in families and entry.name == "__init__.py")
            if not own:  # compiled kernels among them
                (copy / room / entry.name).symlink_to(entry)
    for name, text in FILES.items():
        family, _, file = name.rpartition("/")
        (copy / name).write_text(text)
        described = re.findall(r"^@description\nclass (\w+)", text, re.MULTILINE)[-1]
        registry = (PACKAGE / family / "__init__.py").read_text()
        union = re.search(rf"^{UNIONS[family]} = Annotated\[\s*([^\]]+),\s*BY_KIND,?\s*\]$", registry, re.MULTILINE)
        assert union is not None, f"no union {UNIONS[family]}"
        line = union[0].replace(union[1], f"{union[1]} | {described}")
        module = f"from sonarsynth.{family.replace('/', '.')}.{file.removesuffix('.py')} import {described}\n"
        (copy / family / "__init__.py").write_text(registry.replace(union[0], f"{module}{line}"))
    return copy


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What plan, store and data say of a frame by the usual methods, and by the new ones, two at a time."""
    folder = tmp_path_factory.mktemp("extended")
    extended(folder)
    recipe = str(ROOT / "configs" / "tank.yaml")
    done = subprocess.run(
        [sys.executable, "-P", "-c", SCRIPT, str(folder), json.dumps([{}, *KINDS]), recipe],
        env=os.environ | {"PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"},
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def test_the_page_has_a_file_for_each_family_whose_methods_answer_the_planner() -> None:
    assert {name.rpartition("/")[0] for name in FILES} == set(UNIONS)


def of(said: dict[str, Any], kind: str) -> dict[str, Any]:
    """What is said of the frame of a kind."""
    (mine,) = (one for name, one in said.items() if kind in name.split())
    found: dict[str, Any] = mine
    return found


@pytest.mark.parametrize(
    ("kind", "stage", "choice"),
    [
        ("coherence_factor", "beamform", "beamforming"),
        ("loudest", "range", "picking"),
        ("monostatic", "range", "placing"),
        ("whole_samples", "synthesise", "synthesis"),
        ("power_cosine", "trace", ""),
        ("isotropic_noise", "synthesise", ""),
        ("measured_current", "trace", ""),
        ("surveyed_source", "locate", ""),
        ("time_gate", "beamform", ""),
        ("pinger", "trace", ""),
        ("surface_patch", "trace", ""),
        ("lommel_seeliger", "reverberation", ""),
    ],
)
def test_it_runs_and_plan_and_store_say_so(said: dict[str, Any], kind: str, stage: str, choice: str) -> None:
    mine = of(said, kind)
    assert kind in mine["rows"][stage][0] and kind not in said["usual"]["rows"].get(stage, [""])[0]
    assert f"kind: {kind}" in mine["recipe"].replace("'", "")
    assert not choice or mine["choices"][choice]["kind"] == kind
    assert ("not stated" in mine["rows"][stage][1]) == (kind == "coherence_factor")


@pytest.mark.parametrize(
    ("kind", "stage", "ratio"), [("coherence_factor", "beamform", 1.2), ("whole_samples", "synthesise", 10.0)]
)
def test_what_it_costs_is_in_the_plan(said: dict[str, Any], kind: str, stage: str, ratio: float) -> None:
    assert of(said, kind)["rows"][stage][2] > ratio * said["usual"]["rows"][stage][2]


def test_the_detector_finds_the_brightest_beam(said: dict[str, Any]) -> None:
    (x0, y0, x1, y1), score, count = said["usual"]["found"]
    energy = np.array(said["usual"]["energy"])
    row, column = np.unravel_index(energy.argmax(), energy.shape)
    assert [x0, y0, x1, y1] == [column, row, column + 1, row + 1] and count == 1
    assert score == pytest.approx(energy.max())


def direct_pulse(one: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (Hz) of the band, and spectra (sensor, bin) of the direct pulse of the tank, on the clock."""
    rate, count = 196e3, 1024
    early = np.array(one["sensors"])[:, : int((0.75e-3 - one["start"]) * rate)]  # the first echo comes at 0.95 ms
    f = np.fft.rfftfreq(count, 1.0 / rate)
    inside = (f > 35e3) & (f < 75e3)
    turned = np.exp(-2j * np.pi * f * one["start"])
    return f[inside], (np.fft.rfft(early, count) * turned)[:, inside]


def test_the_current_is_in_direct_sound_at_each_hydrophone_and_in_the_truth(said: dict[str, Any]) -> None:
    mine, usual, current = said["measured_current"], said["usual"], np.array([10.0, 10.0, 0.0])
    (f, with_it), (_, still) = direct_pulse(mine), direct_pulse(usual)
    turned = np.angle(with_it * still.conj())
    weight = np.abs(still) ** 2
    late = -(turned * f * weight).sum(axis=1) / (2.0 * np.pi * f**2 * weight).sum(axis=1)
    place = np.array(mine["position"]) + [0.0, 0.0, -0.15]
    expected = -(place - [0.6, -0.25, -0.3]) @ current / 1483.5**2
    assert np.ptp(expected) > 8e-7, "it differs over the array: rays to the probes must know it"
    np.testing.assert_allclose(late, expected, atol=2e-8)
    met = mine["meeting"] - usual["meeting"]
    assert met == pytest.approx(-(np.array([1.0, 0.0, -0.16]) - [0.6, -0.25, -0.3]) @ current / 1483.5**2, rel=0.02)


def test_the_source_is_where_it_was_surveyed_and_its_reflection_is_gated(said: dict[str, Any]) -> None:
    mine, usual = of(said, "surveyed_source"), said["usual"]
    np.testing.assert_allclose(mine["source"], [0.6, -0.25, -0.15], atol=1e-6)  # the array looks along x of the world
    assert mine["heard"] == pytest.approx(mine["true"], abs=2e-6)
    assert usual["delay"] and not mine["delay"] and np.isnan(mine["energy"]).all(), "the gate leaves no sound to image"


def test_the_pinger_sweeps_at_its_level(said: dict[str, Any]) -> None:
    mine, rate = of(said, "pinger"), 196e3
    sound, place = np.array(mine["sensors"]), np.array(mine["position"]) + [0.0, 0.0, -0.15]
    distance = np.linalg.norm(place - [0.6, -0.25, -0.3], axis=1)
    middle = (distance / 1483.5 - mine["start"]) * rate
    for row, at, far in zip(sound, middle, distance, strict=True):
        ping = row[int(at - 1e-4 * rate) : int(at + 1e-4 * rate)]
        assert 0.3 < np.abs(ping).max() * far / 10.0 ** ((170.0 - 120.0) / 20.0) < 1.05, "but for a hydrophone's face"
        assert np.abs(row[: int(at - 2.5e-4 * rate)]).max() < 1e-3 * np.abs(ping).max(), "silence before"
        halves = np.abs(np.fft.rfft(ping[: ping.size // 2 * 2].reshape(2, -1), 256)) ** 2
        early, late = (float(np.average(np.fft.rfftfreq(256, 1.0 / rate), weights=half)) for half in halves)
        assert 40e3 < early < late - 4e3 < 66e3


def test_the_surface_is_heard_when_sound_can_have_been_there(said: dict[str, Any]) -> None:
    mine, usual = of(said, "surface_patch"), said["usual"]
    more = np.abs(np.subtract(mine["sensors"], usual["sensors"])).max(axis=0)
    source, array = np.array([0.6, -0.25, -0.3]), np.array([0.0, 0.0, -0.15])
    corners = np.array([[x, y, 0.0] for x in (1.0, 1.2) for y in (-0.1, 0.1)])
    way = np.linalg.norm(corners - source, axis=1) + np.linalg.norm(corners - array, axis=1)
    heard = mine["start"] + np.flatnonzero(more > 0.3 * more.max()) / 196e3
    assert way.min() / 1490.0 - 3e-5 < heard[0] and heard[-1] < way.max() / 1480.0 + 3e-5
    assert more.max() > 1e-4 * np.abs(usual["sensors"]).max()


def test_the_bottom_is_heard_after_it_is_lit(said: dict[str, Any]) -> None:
    """By the surface: sound along the bottom, where the shrimp sits, lights nothing."""
    mine, usual = of(said, "lommel_seeliger"), said["usual"]
    more = np.abs(np.subtract(mine["sensors"], usual["sensors"])).max(axis=0)
    by_mirrors = np.linalg.norm([0.6, -0.25, 0.3 + 0.45]) / 1490.0  # image over the surface to array under the bottom
    heard = mine["start"] + np.flatnonzero(more > 0.3 * more.max()) / 196e3
    assert more.max() > 1e-3 * np.abs(usual["sensors"]).max()
    assert heard[0] > by_mirrors - 1e-4, "but for the rise of the snap before its peak"


def test_the_noise_is_as_loud_as_it_says(said: dict[str, Any]) -> None:
    heard = np.subtract(of(said, "isotropic_noise")["pressure"], said["usual"]["pressure"])
    assert np.std(heard) == pytest.approx(0.01 * np.sqrt(50e3), rel=0.3)  # 80 dB re 1 uPa2/Hz, over 50 kHz


def test_the_data_are_those_of_the_method(said: dict[str, Any]) -> None:
    usual, sonar, sound = (said[name] for name in ("usual", *(" ".join(some.values()) for some in KINDS[:2])))
    assert sonar["pressure"] == usual["pressure"]
    plain, least = (np.array(one["energy"]) for one in (usual, sonar))
    assert (least <= 1.1 * plain + 0.02 * plain.max()).all(), "the factor is one at most, by Cauchy and Schwarz"
    assert np.median(least / plain) < 0.7
    assert np.abs(np.subtract(*(np.unravel_index(e.argmax(), e.shape) for e in (plain, least)))).max() <= 3  # a beam
    assert len(sonar["delay"]) == 1 and sonar["delay"] != usual["delay"], "on the axis of the loudest beam"
    straight = 0.5 * (1484.0 * sonar["delay"][0] + np.linalg.norm([0.6, -0.25, -0.15]))
    assert sonar["range"][0] == pytest.approx(straight, rel=0.01)
    assert all(0.3 < r < 3.0 for r in sonar["range"]), "points of the image lie in the tank"
    wrong = [abs(a - b) for a, b in zip(sound["pressure"], usual["pressure"], strict=True)]
    assert 0.0 < max(wrong) < max(map(abs, usual["pressure"]))
    assert np.abs(np.log10(np.max(sound["energy"]) / plain.max())) > 0.05
