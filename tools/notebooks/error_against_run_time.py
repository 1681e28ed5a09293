# ---
# jupyter:
#   jupytext:
#     text_representation: {extension: .py, format_name: percent}
# ---

# %% [markdown]
# # Error against run time
#
# Every approximation is a setting with an error. `ss.accuracy` computes a frame the slow, exact way, varies one
# setting after the other, and says where the choice of the planner lies. The array is small, the snap is a test pulse,
# and only two hydrophones are computed exactly, so that the page takes seconds.

# %%
from collections import defaultdict
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.ticker import NullFormatter

import sonarsynth as ss

here = Path.cwd()
root = next(folder for folder in (here, *here.parents) if (folder / "configs" / "grid.yaml").is_file())

# %%
small = "scene.sonar.array={kind: planar_lattice, columns: 6, rows: 4, pitch: 5 cm}"
pulse = "scene.world.sources.0.snap={kind: ricker, frequency: 40 kHz}"
recipe = ss.load(root / "configs" / "grid.yaml", [small, pulse])
measured = ss.accuracy(recipe, frames=[0], hydrophones=2, peers=False)
print(f"{measured.title}: {measured.hydrophones} hydrophones computed exactly")

# %% [markdown]
# ## What the planner chose
#
# Each verdict compares the choice with the tolerance, and with the cheapest setting that keeps it.

# %%
for verdict in measured.verdicts:
    print(
        f"{verdict.stage:10s} {verdict.choice}: error {verdict.error:.2g} {verdict.unit} "
        f"(allowed {verdict.allowed:g}), {1e3 * verdict.seconds:.1f} ms of CPU time"
    )

# %% [markdown]
# ## The picture
#
# One colour is one setting, varied; a circle is what the planner chose. To the left is faster, below is more exact.

# %%
stages = {"trace": "tracing", "synthesis": "synthesis", "image": "image"}
figure, panels = plt.subplots(1, len(stages), figsize=(14, 5.2), layout="constrained")
for axes, (stage, title) in zip(panels, stages.items(), strict=True):
    points = [p for p in measured.points if p.stage == stage and p.role == "point" and p.error > 0]
    knobs = defaultdict(list)
    for point in points:
        knobs[point.knob].append((1e3 * point.seconds, point.error))
    for knob, settings in knobs.items():
        axes.loglog(*zip(*settings, strict=True), "o", label=knob, alpha=0.7)
    for point in points:
        if point.chosen:
            axes.loglog(1e3 * point.seconds, point.error, "o", markersize=14, fillstyle="none", color="black")
    axes.axhline(points[0].allowed, color="black", linestyle="--", linewidth=0.8, label="allowed")
    fastest, slowest = min(p.seconds for p in points), max(p.seconds for p in points)
    axes.set_xlim(1e3 * fastest / 5, 1e3 * slowest * 5)
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set(xlabel="CPU time of a frame (ms)", ylabel=f"error ({points[0].unit})", title=title)
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3)
plt.show()
