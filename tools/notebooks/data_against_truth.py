# ---
# jupyter:
#   jupytext:
#     text_representation: {extension: .py, format_name: percent}
# ---

# %% [markdown]
# # Data against truth
#
# Every frame comes with the exact truth. This page compares the three products with it: the image with the box of
# the target, the points with the surface of the target, and the source estimates with the snap. The sonar assumes a
# sound speed that is 1 m/s too high, as a real one might.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import sonarsynth as ss

here = Path.cwd()
root = next(folder for folder in (here, *here.parents) if (folder / "configs" / "remus.yaml").is_file())
path = Path(tempfile.mkdtemp()) / "remus.zarr"

# %%
frames = range(8, 64, 12)
recipe = ss.load(root / "configs" / "remus.yaml", ["scene.sonar.assumed_sound_speed=1541 m/s"])
ss.build(recipe, path, frames=frames, workers=0)
store = ss.open(path).isel(frame=list(frames))
image, cloud, estimates = store["image"], store["cloud"], store["source_estimates"]
targets, emissions = store["truth/targets"], store["truth/emissions"]

# %% [markdown]
# ## The image and the box of the target
#
# `image_box` bounds the visible part of the target in azimuth and elevation, where the sound met it, as the image shows
# it. The brightest beam may lie beside the box by a part of a beam's width.

# %%
peak = image["energy"].argmax(["elevation", "azimuth"])
azimuth = image["azimuth"].values[peak["azimuth"].values]
elevation = image["elevation"].values[peak["elevation"].values]
low_azimuth, high_azimuth, low_elevation, high_elevation = targets["image_box"].sel(target="remus").values.T
beside_azimuth = np.maximum(np.maximum(low_azimuth - azimuth, azimuth - high_azimuth), 0)
beside_elevation = np.maximum(np.maximum(low_elevation - elevation, elevation - high_elevation), 0)
beside = np.hypot(beside_azimuth, beside_elevation)
for frame, angle in zip(frames, beside, strict=True):
    print(f"frame {frame:2d}: brightest beam {'in the box' if angle == 0 else f'{angle:.2f} deg from the box'}")

# %% [markdown]
# ## The points and the surface of the target
#
# Each point says whose echo it is (`target`, -1 for none), how far it lies from the surface of that target
# (`distance`), where the echo was made (`true_range`), and which error the sonar itself predicts (`range_error`).

# %%
values = {name: cloud[name].values.ravel() for name in ("target", "distance", "range", "true_range", "range_error")}
on_target = np.isfinite(values["range"]) & (values["target"] >= 0)
distance = values["distance"][on_target]
error = (values["range"] - values["true_range"])[on_target]
normalised = error / values["range_error"][on_target]
print(f"{on_target.sum()} points on the target, median distance from its surface {np.median(distance) * 100:.1f} cm")
print(
    f"range error: median {np.median(np.abs(error)) * 100:.1f} cm, {np.mean(np.abs(normalised) < 3):.0%} within 3 sigma"
)

# %% [markdown]
# ## The source estimates and the snap
#
# The sonar estimates when and from where the snap arrived, with a predicted standard error that allows for 1 m/s of
# sound speed: the angles are wrong by just that here. The truth has when and from where it really arrived.

# %%
comparison = {
    "time (ns)": ("time", "arrival", 1e9),
    "azimuth (mdeg)": ("azimuth", "azimuth", 1e3),
    "elevation (mdeg)": ("elevation", "elevation", 1e3),
}
source_errors = {}
for label, (name, true_name, scale) in comparison.items():
    found = (estimates[name].isel(estimate=0) - emissions[true_name].isel(emission=0)).values
    predicted = estimates[f"{name}_error"].values[:, 0]
    source_errors[label] = found / predicted
    print(f"{label}: error at most {np.abs(found).max() * scale:.3g}, predicted {predicted.max() * scale:.3g}")

# %%
figure, (left, middle, right) = plt.subplots(1, 3, figsize=(14, 4.2), layout="constrained")
shown = len(frames) // 2
energy = image["energy"].isel(frame=shown)
decibels = (10 * np.log10(energy / energy.max())).assign_attrs(long_name="energy re the brightest beam", units="dB")
decibels.plot(ax=left, vmin=-40, cmap="inferno", xincrease=False)
left.add_patch(
    plt.Rectangle(
        (low_azimuth[shown], low_elevation[shown]),
        high_azimuth[shown] - low_azimuth[shown],
        high_elevation[shown] - low_elevation[shown],
        fill=False,
        color="cyan",
        linewidth=2,
    )
)
left.plot(azimuth[shown], elevation[shown], "kx")
left.set(xlim=(10, -10), ylim=(-5, 8), title=f"frame {frames[shown]}: brightest beam and true box")
middle.hist(100 * distance, bins=20)
middle.set(xlabel="distance from the surface (cm)", ylabel="points", title="points on the target")
for label, ratio in source_errors.items():
    right.plot(frames, ratio, "o--", label=label.split(" (")[0], fillstyle="none")
right.set(xlabel="frame", ylabel="error / predicted standard error", title="source estimates", ylim=(-3, 3))
right.legend()
plt.show()
