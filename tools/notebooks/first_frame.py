# ---
# jupyter:
#   jupytext:
#     text_representation: {extension: .py, format_name: percent}
# ---

# %% [markdown]
# # A first frame
#
# A recipe becomes a frame by one call, without a store. This page writes a whole recipe, makes one frame of it, and
# looks at its four parts: the signals of the hydrophones, the image, the points, and the truth. A pipe lies 15 m ahead
# of 320 hydrophones, lit by one snap from the right.

# %%
import matplotlib.pyplot as plt
import numpy as np

import sonarsynth as ss

recipe = ss.loads("""
scene:
  world:
    environment: {depth: 12 m, sound_speed: {kind: isovelocity, speed: 1535 m/s}, noise: {kind: flat, level: 40 dB}}
    targets:
      - name: pipe
        shape: {kind: cylinder, radius: 15 cm, length: 2 m}
        motion: {kind: still, position: [15, 1, -7], heading: 336 deg}
    sources: [{kind: snapping_shrimp, position: [10, -4], source_level: 190 dB}]
  sonar:
    array: {kind: planar_lattice, columns: 20, rows: 16, pitch: 5 cm}
    assumed_sound_speed: 1535 m/s
  trajectory: {frames: 1, sonar: {kind: still, position: [0, 0, -6], heading: 90 deg}}
""")
frame = ss.render(recipe, 0)
print(frame)

# %% [markdown]
# ## Signals
#
# The snap reaches the array first, by far the loudest. The echo of the pipe follows some milliseconds later, and each
# hydrophone hears it at its own time. Note the two scales.

# %%
pressure, start = frame["signals/pressure"], float(frame["signals/start"])
rate = recipe.scene.sonar.sampling_frequency
time = 1e3 * (start + np.arange(pressure.sizes["sample"]) / rate)
window = float(frame["image/start"]), float(frame["image/stop"])

# %% [markdown]
# ## Image, points and truth
#
# The image has the energy of the echo window in each direction, port on the left as the sonar looks. The red box is
# where the array sees the pipe, from the truth. The points are echoes picked from the beams and placed in space by
# the delay after the direct pulse; the mesh of the pipe is the truth.

# %%
energy = frame["image/energy"]
decibels = 10 * np.log10(energy / energy.max())
left, right, low, high = frame["truth/targets/image_box"].sel(target="pipe").values
cloud = frame["cloud"]
count = int(cloud["count"])
print(f"{count} points; distance from the hull: median {100 * float(cloud['distance'][:count].median()):.1f} cm")

figure, axes = plt.subplots(2, 2, figsize=(12, 9), layout="constrained")
for sensor in (0, 19, 160, 319):
    axes[0, 0].plot(time, pressure[sensor], linewidth=0.6, label=f"hydrophone {sensor}")
    echo = (time > 1e3 * window[0]) & (time < 1e3 * window[1])
    axes[0, 1].plot(time[echo], pressure[sensor].values[echo], linewidth=0.7)
axes[0, 0].set(title="what four hydrophones hear", xlabel="time after the instant of the frame (ms)", ylabel="Pa")
axes[0, 0].legend(fontsize="small")
axes[0, 1].set(title="the echo window alone", xlabel="time after the instant of the frame (ms)", ylabel="Pa")
axes[1, 0].set_title("image, and the true box")
shown = axes[1, 0].pcolormesh(energy.azimuth, energy.elevation, decibels, vmin=-40, cmap="inferno")
axes[1, 0].add_patch(plt.Rectangle((left, low), right - left, high - low, fill=False, color="red"))
axes[1, 0].set(xlabel="azimuth (deg), port on the left", ylabel="elevation (deg)")
axes[1, 0].invert_xaxis()
figure.colorbar(shown, ax=axes[1, 0], label="dB re the brightest beam")
corners = frame["truth/targets/box"].sel(target="pipe").values  # 8 corners in the sonar frame
for a, b in ((0, 1), (0, 2), (1, 3), (2, 3), (4, 5), (4, 6), (5, 7), (6, 7), (0, 4), (1, 5), (2, 6), (3, 7)):
    axes[1, 1].plot(corners[[a, b], 1], corners[[a, b], 0], color="grey", linewidth=0.8)
axes[1, 1].scatter(cloud["y"][:count], cloud["x"][:count], s=18, color="tab:red", label="points")
axes[1, 1].set(title="from above: points, and the box of the pipe", xlabel="y, to port (m)", ylabel="x, ahead (m)")
axes[1, 1].set_aspect("equal")
axes[1, 1].invert_xaxis()
axes[1, 1].legend()
plt.show()
