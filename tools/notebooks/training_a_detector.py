# ---
# jupyter:
#   jupytext:
#     text_representation: {extension: .py, format_name: percent}
# ---

# %% [markdown]
# # Training a detector
#
# A small network is trained on the frames of one split and judged on another, beside a threshold and CFAR, which are
# not trained. Then all three are judged on other water: a cast with a thermocline, noise of the same levels that comes
# from the surface and not from nowhere, wind, and hydrophones that err. What a detector loses there is the gap to be
# seen before the sea shows it.
#
# The network is a perceptron of scikit-learn, which comes with Open3D: it looks at the beams about a beam and says
# whether an object is there. It trains in seconds on one core; a better one needs torch or JAX, and the same samples.

# %%
import os
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.ndimage import maximum_filter
from sklearn.neural_network import MLPClassifier

import sonarsynth as ss
from sonarsynth.detection import Region
from sonarsynth.loading import Frames

here = Path.cwd()
root = next(folder for folder in (here, *here.parents) if (folder / "configs" / "survey.yaml").is_file())
folder = Path(os.environ.get("STORES") or tempfile.mkdtemp())
sequences = int(os.environ.get("SEQUENCES", "100"))
seeds = range(3)

# %% [markdown]
# ## Two datasets
#
# Of two frames a sequence, 0 to 5 bodies among rocks. More sequences make a better network: 450 take some 5 minutes.

# %%
survey = root / "configs" / "survey.yaml"
drawn = [f"{{name: shrimp_{n}, path: sources.shrimp.position.{n}, kind: sobol, low: 5 m, high: 12 m}}" for n in (0, 1)]
drawn.append("{name: noise, path: environment.noise.0.level, kind: uniform, low: 50 dB, high: 65 dB}")
shift = [
    "seed=77",
    "scene.world.environment.sound_speed="
    "{kind: tabulated, depth: [0 m, 6 m, 10 m, 15 m], speed: [1545, 1543, 1530, 1527]}",
    "scene.world.environment.noise="
    "[{kind: flat, level: 50 dB, directions: {kind: surface}}, {kind: wenz, wind_speed: 12 m/s}]",
    "scene.sonar.sensor_errors={gain: 3 dB, phase: 25 deg, dead: 0.05}",
    f"variations=[{', '.join(drawn)}]",
]
stores = {"same": folder / "survey.zarr", "shifted": folder / "shifted.zarr"}
for (name, path), settings, count in zip(stores.items(), ([], shift), (sequences, max(sequences // 3, 4)), strict=True):
    recipe = ss.load(survey, ["splits={train: 0.7, test: 0.3}", *settings, f"repeats={count}"])
    ss.build(ss.plan(recipe, products=("image", "cloud")), path, workers=0)
    print(f"{name}: {count} sequences in {path}")

# %% [markdown]
# ## Examples
#
# Levels over the median of the image, 13 by 13 beams about each. Those within 1.5 beams of the middle of an object are
# objects; of the others all bright spots are taken, and 80 at random.

# %%
REACH, SCALE = 6, 10.0


def levels(energy: np.ndarray) -> np.ndarray:
    ratio = np.nan_to_num(energy) / max(float(np.nanmedian(energy)), 1e-30)
    return np.clip(10.0 * np.log10(np.maximum(ratio, 1e-3)), -5.0, 30.0).astype(np.float32) / SCALE


def patches(image: np.ndarray) -> np.ndarray:
    padded = np.pad(image, REACH, constant_values=-0.5)
    side = 2 * REACH + 1
    return np.lib.stride_tricks.sliding_window_view(padded, (side, side)).reshape(-1, side * side)


def examples(data: Frames, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    looks, truths = [], []
    for row in range(len(data)):
        image, boxes = levels(data[row]["image"]), data[row]["boxes"]
        y, x = np.mgrid[: image.shape[0], : image.shape[1]] + 0.5
        middle = 0.5 * (boxes[:, None, None, :2] + boxes[:, None, None, 2:])
        own = (np.hypot(x - middle[..., 0], y - middle[..., 1]) <= 1.5).any(axis=0)
        bright = (image == maximum_filter(image, 5)) & ~own
        others = random.choice(np.flatnonzero(~own), 80, replace=False)
        some = np.concatenate([np.flatnonzero(own), np.flatnonzero(bright), others])
        looks.append(patches(image)[some])
        truths.append(own.ravel()[some])
    return np.concatenate(looks), np.concatenate(truths)


# %% [markdown]
# ## A detector
#
# A detector is anything with a `kind` that finds `regions` in a view of a frame. This one takes the beams where the
# network is surest, with two beams about each.


# %%
class Network:
    kind = "network"

    def __init__(self, data: Frames, seed: int) -> None:
        looks, truths = examples(data, np.random.default_rng(seed))
        self.net = MLPClassifier(
            (64, 32), alpha=1e-3, early_stopping=True, n_iter_no_change=5, max_iter=300, random_state=seed
        )
        self.net.fit(looks, truths)

    def regions(self, view):
        image = levels(view.energy)
        sure = self.net.predict_proba(patches(image))[:, 1].reshape(image.shape)
        found = []
        for row, column in np.argwhere((sure == maximum_filter(sure, 5)) & (sure > 0.02)):
            rows = np.arange(max(row - 2, 0), min(row + 3, image.shape[0]))
            columns = np.arange(max(column - 2, 0), min(column + 3, image.shape[1]))
            found.append(Region(rows, columns, float(sure[row, column])))
        return found


train = Frames(stores["same"], split="train", image="energy")
networks = [Network(train, seed) for seed in seeds]
print(f"trained on {len(train)} frames, {len(seeds)} seeds")

# %% [markdown]
# ## Judged
#
# `peaks` is a threshold. The band of a detector is that of 95 % of the number of objects, of the network also the least
# and the most of its seeds.

# %%
detectors = {"peaks": ["peaks"], "cfar": ["cfar"], "network": networks}
figures = {}
for name, path in stores.items():
    split = "test" if name == "same" else None
    for kind, some in detectors.items():
        figures[name, kind] = [
            ss.evaluate(path, ss.detect(path, one, split=split), split=split).as_json() for one in some
        ]


def shares(rows):
    """Least and most of the seeds, and the widest of their bands."""
    found = sorted({f"{row['detected']:.2f}" for row in rows})
    band = f"({min(row['low'] for row in rows):.2f} to {max(row['high'] for row in rows):.2f})"
    return f"{' to '.join([found[0], *found[1:][-1:]])} {band}"


counts = [figures[name, "peaks"][0]["objects"] for name in stores]
print(f"\n{counts[0]} objects in the same water, {counts[1]} in the other\n")
print("| | AP at 2 m, same water | other water | found at 1 false alarm a frame, same water | other water |")
print("|---|---|---|---|---|")
for kind in detectors:
    judged = [figures[name, kind] for name in stores]
    precision = [", ".join(f"{found['ap_2m']:.2f}" for found in some) for some in judged]
    print(
        "|",
        " | ".join([kind, *precision, *(shares([found["detection"][3] for found in some]) for some in judged)]),
        "|",
    )

# %%
drawn, axes = plt.subplots(1, 2, figsize=(10, 4), sharey=True)
for name, ax in zip(stores, axes, strict=True):
    for kind in detectors:
        for found in figures[name, kind][:1]:
            rates = found["detection"]
            share = np.array([row["detected"] for row in rates])
            band = [share - [row["low"] for row in rates], [row["high"] for row in rates] - share]
            ax.errorbar([row["false_alarms_a_frame"] for row in rates], share, band, label=kind, capsize=3)
    ax.set(xscale="log", xlabel="false alarms a frame", title=f"{name} water", ylim=(0, 1))
axes[0].set_ylabel("objects found")
axes[0].legend()
plt.show()

# %% [markdown]
# ## By signal-to-noise ratio
#
# `snr` of each target is a label: its echoes in the beam at it over all that is heard there beside them.

# %%
drawn, axes = plt.subplots(1, 2, figsize=(10, 4), sharey=True)
for name, ax in zip(stores, axes, strict=True):
    groups = list(figures[name, "peaks"][0]["by_snr"])
    water = "same" if name == "same" else "other"
    print(f"\n| {water} water, by snr | {' | '.join(groups)} |\n|{'---|' * (len(groups) + 1)}")
    for place, kind in enumerate(detectors):
        rows = {group: [found["by_snr"][group] for found in figures[name, kind]] for group in groups}
        share = np.array([rows[group][0]["detected"] for group in groups])
        band = [
            share - [rows[group][0]["low"] for group in groups],
            [rows[group][0]["high"] for group in groups] - share,
        ]
        ax.bar(np.arange(len(groups)) + 0.27 * (place - 1), share, 0.25, yerr=band, label=kind, capsize=2)
        if kind == "peaks":
            print("|", " | ".join(["objects", *(str(rows[group][0]["objects"]) for group in groups)]), "|")
        print("|", " | ".join([kind, *(shares(rows[group]) for group in groups)]), "|")
    ax.set_xticks(range(len(groups)), groups, rotation=30)
    ax.set(title=f"{name} water")
axes[0].set_ylabel("objects found at 1 false alarm a frame")
axes[0].legend()
plt.show()
