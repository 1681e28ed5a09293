# ---
# jupyter:
#   jupytext:
#     text_representation: {extension: .py, format_name: percent}
# ---

# %% [markdown]
# # Eigenrays and ghosts
#
# In layered water with a surface and a bottom, sound goes from a point to a point by many ways. `ss.eigenrays` finds
# all of them. An echo comes back by each, so that the sonar sees the target more than once: the others are its ghosts.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import sonarsynth as ss

here = Path.cwd()
root = next(folder for folder in (here, *here.parents) if (folder / "configs" / "thermocline.yaml").is_file())

# %% [markdown]
# ## Every ray between two points
#
# A table: travel time, angles (down positive), bounces, caustics and loss. With more bounces allowed there are more
# rays; none is missed, none comes twice.

# %%
water = ss.Thermocline(mixed_depth=6.5)
rays = ss.eigenrays(water, 10.0, 4.5, 5.0, 20.0, vertices=2)
print(rays)

# %% [markdown]
# Along the range the arrivals spread: late ones are steep and have bounced.

# %%
ranges = np.linspace(5.0, 100.0, 150)
fan = ss.eigenrays(water, 10.0, 4.5, 5.0, ranges, vertices=2)
bounces = np.asarray(fan.surface) + np.asarray(fan.bottom)

# %% [markdown]
# ## The ghosts in an image
#
# One frame of `configs/thermocline.yaml`, every path by surface and bottom, with fewer hydrophones and a coarser hull,
# to be quick. The points know by which family of paths
# their echo came: those of `direct` lie on the target, the others are ghosts.

# %%
small = [
    "scene.sonar.array={kind: planar_lattice, columns: 20, rows: 20, pitch: 5 cm}",
    "scene.world.targets.0.shape={kind: remus100, edge: 8 cm}",
]
frame = ss.render(ss.load(root / "configs" / "thermocline.yaml", small), 46)
energy, cloud = frame["image/energy"], frame["cloud"]
count = int(cloud["count"])
family = cloud["family"].values[:count]
names = dict(
    enumerate(cloud["family"].attrs["flag_meanings"].split(), start=int(min(cloud["family"].attrs["flag_values"])))
)
azimuth, elevation = cloud["azimuth"].values[:count], cloud["elevation"].values[:count]
left, right, low, high = frame["truth/targets/image_box"].sel(target="remus").values
for number in np.unique(family):
    print(f"{names[number]}: {np.sum(family == number)} points")

# %%
figure, axes = plt.subplots(1, 3, figsize=(15, 4.6), layout="constrained")
for kind in range(3):
    chosen = bounces == kind
    axes[0].plot(
        ranges[np.asarray(fan.pair)[chosen]],
        1e3 * fan.travel_time[chosen] - 1e3 * ranges[np.asarray(fan.pair)[chosen]] / 1541.0,
        ".",
        markersize=2,
        label=f"{kind} bounces",
    )
    axes[1].plot(ranges[np.asarray(fan.pair)[chosen]], np.rad2deg(fan.arrival_angle[chosen]), ".", markersize=2)
axes[0].set(title="travel time less range / 1541 m/s", xlabel="range (m)", ylabel="ms", ylim=(-0.1, 6))
axes[0].legend(markerscale=5)
axes[1].set(title="angle of arrival, down positive", xlabel="range (m)", ylabel="deg")
decibels = 10 * np.log10(energy / energy.max())
shown = axes[2].pcolormesh(energy.azimuth, energy.elevation, decibels, vmin=-30, cmap="gray")
for number, colour in zip(np.unique(family), plt.cm.tab10.colors, strict=False):
    axes[2].plot(azimuth[family == number], elevation[family == number], "o", color=colour, label=names[number])
axes[2].add_patch(plt.Rectangle((left, low), right - left, high - low, fill=False, color="red"))
axes[2].set(
    title="image, points by family, true box", xlabel="azimuth (deg), port on the left", ylabel="elevation (deg)"
)
axes[2].invert_xaxis()
axes[2].legend(fontsize="small")
figure.colorbar(shown, ax=axes[2], label="dB re the brightest beam")
plt.show()
