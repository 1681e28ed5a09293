# ---
# jupyter:
#   jupytext:
#     text_representation: {extension: .py, format_name: percent}
# ---

# %% [markdown]
# # Author a scene, and look before you build
#
# A dataset begins as a text. This page writes a recipe of its own, mends it by what the reader of recipes, the preview
# and the plan say, and makes one frame. No sound is computed before the last step.

# %%
import json
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import sonarsynth as ss

work = Path(tempfile.mkdtemp())
text = """
title: A drone in a bay
seed: 4
scene:
  world:
    environment:
      depth: 12 m
      sound_speed: {kind: isovelocity, speed: 1540 m/s}
      noise: {kind: flat, level: 30 dB}
    targets:
      - name: drone
        shape: {kind: cylinder, radius: 15 cm, length: 1.6 m}
        motion: {kind: course, start: [16, 2, -7], heading: 200 deg, speed: 1.5 m/s}
    sources: [{kind: snapping_shrimp, position: [10, -5], source_level: 190 dB}]
  sonar: {array: {kind: planar_lattice, columns: 16, rows: 12, pitch: 5 cm}}
  trajectory: {frames: 4, interval: 0.25 s, sonar: {kind: still, position: [0, 0, -6], heading: 90 deg}}
variations:
  - {name: range, path: scene.world.targets.0.motion.start.0, kind: uniform, low: 13 m, high: 25 m}
  - {name: side, path: scene.world.targets.0.motion.start.1, kind: uniform, low: -12 m, high: 12 m}
  - {name: snap, path: scene.world.sources.0.position.1, kind: uniform, low: -9 m, high: -4 m}
  - {name: heading, path: scene.world.targets.0.motion.heading, kind: uniform, low: 0 deg, high: 360 deg}
repeats: 200
splits: {train: 0.7, validation: 0.1, test: 0.2}
"""

# %% [markdown]
# ## What is wrong is said in one line
#
# A unit that is none, a name that nothing has, a value that cannot be: the line and the field are named.

# %%
for right, wrong in (
    ("radius: 15 cm", "radius: 15 kg"),
    ("heading: 200", "heading: 2oo"),
    ("speed: 1.5", "spede: 1.5"),
):
    try:
        ss.loads(text.replace(right, wrong))
    except ss.RecipeError as problem:
        print(problem)

# %% [markdown]
# ## What the frames would hold
#
# `preview` draws scenes and distributions; its numbers are in `preview.json`. Of the first draft many frames have no
# target in view: the drone starts up to 12 m aside, while the beams look 25 degrees to both sides.


# %%
def preview(recipe, name):
    """Pictures and numbers of a recipe; prints in how many of its frames the target is in view."""
    ss.preview(recipe, work / name, sequences=50)
    numbers = json.loads((work / name / "preview.json").read_text())
    drone = numbers["targets"]["drone"]
    print(f"{name}: in view in {drone['frames_in_view']} of {drone['frames']} frames that were looked at")
    return numbers


draft = ss.loads(text)
preview(draft, "draft")
recipe = ss.loads(text.replace("low: -12 m, high: 12 m", "low: -3.5 m, high: 3.5 m"))
numbers = preview(recipe, "mended")
print(f"ranges from {numbers['range']['all']['least']:.1f} to {numbers['range']['all']['greatest']:.1f} m")

# %% [markdown]
# ## What the build will do
#
# The plan chooses methods by the accuracy that the recipe asks for, and says what it leaves out, at which cost.

# %%
plan = ss.plan(recipe)
print(plan)

# %% [markdown]
# ## One frame
#
# The frame holds what the preview promised: the target is where its box is. Its brightest beam may lie beside the box
# by a part of a beam's width.

# %%
frame = ss.render(plan, 2)
energy = frame["image/energy"]
left, right, low, high = frame["truth/targets/image_box"].sel(target="drone").values
peak = energy.argmax(["elevation", "azimuth"])
azimuth, elevation = float(energy.azimuth[peak["azimuth"]]), float(energy.elevation[peak["elevation"]])
print(
    f"brightest beam: {azimuth:.1f}, {elevation:.1f} deg; box: {left:.1f} to {right:.1f}, {low:.1f} to {high:.1f} deg"
)

figure, axes = plt.subplots(1, 3, figsize=(20, 6), layout="constrained", width_ratios=(1.6, 1.2, 1))
for panel, file in zip(axes, ("scene-0.png", "distributions.png"), strict=False):
    panel.imshow(plt.imread(work / "mended" / file))
    panel.set_axis_off()
decibels = 10 * np.log10(energy / energy.max())
shown = axes[2].pcolormesh(energy.azimuth, energy.elevation, decibels, vmin=-20, cmap="inferno")
axes[2].add_patch(plt.Rectangle((left, low), right - left, high - low, fill=False, color="cyan"))
axes[2].set(title="frame 2, and the true box", xlabel="azimuth (deg), port on the left", ylabel="elevation (deg)")
axes[2].invert_xaxis()
figure.colorbar(shown, ax=axes[2], label="dB re the brightest beam")
plt.show()
