# ---
# jupyter:
#   jupytext:
#     text_representation: {extension: .py, format_name: percent}
# ---

# %% [markdown]
# # From one recipe to a cluster
#
# A recipe of a grid is many sequences, and a build of them is work for many processes. This page starts a small cluster
# of Dask on this machine, builds a part of a dataset on it, stops, goes on, and compares with what one process makes.
# On a cluster of machines the same call gets another address (page *Building at scale*).

# %%
import json
import tempfile
from collections import defaultdict
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import zarr
from distributed import SubprocessCluster

import sonarsynth as ss

here = Path.cwd()
root = next(folder for folder in (here, *here.parents) if (folder / "configs" / "grid.yaml").is_file())
work = Path(tempfile.mkdtemp())
recipe = ss.load(root / "configs" / "grid.yaml")
plan = ss.plan(recipe)
print(f"{recipe.sequences} sequences, {recipe.frames} frames")

# %% [markdown]
# ## A cluster
#
# `SubprocessCluster` starts a scheduler and two workers by commands, as a batch system does; `LocalCluster` of Dask, or
# `SLURMCluster` of dask-jobqueue are used alike. `build` needs the address alone. Between machines it wants TLS; on one
# machine it goes on without, and says that whoever reaches the address can run code here.
#
# First one shard of 8 frames, then another call for 24: it finds what is there, and makes the rest.

# %%
with SubprocessCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
    address = cluster.scheduler_address
    first = ss.build(plan, work / "cluster.zarr", frames=range(8), scheduler=address)
    second = ss.build(plan, work / "cluster.zarr", frames=range(24), scheduler=address)
for report in (first, second):
    print(f"{report.wanted} frames wanted, {report.there} there, {report.written} made, {len(report.failures)} failed")
print(*second.notes[-1:])

# %% [markdown]
# ## The same bits
#
# One process, another order, another cluster, a build that was killed: the arrays are the same to the bit.

# %%
ss.build(plan, work / "alone.zarr", frames=range(8, 16), workers=0)
one, other = (zarr.open_group(work / name, mode="r") for name in ("alone.zarr", "cluster.zarr"))
compared = 0
for name, array in one.members(max_depth=None):
    if isinstance(array, zarr.Array) and array.shape[:1] == (recipe.frames,):
        assert np.array_equal(np.asarray(array[8:16]), np.asarray(other[name][8:16]), equal_nan=array.dtype.kind == "f")
        compared += 1
print(f"{compared} arrays of 8 frames are the same bit for bit")

# %% [markdown]
# ## What a frame costs
#
# Beside the store stand a log and the run times of every frame. The first frame of a process is dear, since it loads
# the compiled kernels and makes ready what the frames share. From the others follows what the whole dataset takes.

# %%
rows = [json.loads(line) for line in (work / "cluster.zarr.times.jsonl").read_text().splitlines()]
cpu = {row["frame"]: row["cpu"] for row in rows if "frame" in row}
stages = defaultdict(list)
for frame in sorted(cpu):
    for stage, seconds in cpu[frame].items():
        stages[stage].append(1e3 * seconds)
usual = sum(float(np.median(values)) for values in stages.values()) / 1e3
print(
    f"a frame: {1e3 * usual:.0f} ms of CPU time (median); "
    f"{recipe.frames} frames: {usual * recipe.frames:.0f} s of one core"
)
print(f"a million frames on 500 cores: {usual * 1e6 / 500 / 60:.0f} min, were all cores as fast and the disks no limit")

# %%
figure, (left, right) = plt.subplots(1, 2, figsize=(13, 4.4), layout="constrained")
bottom = np.zeros(len(cpu))
for stage, values in stages.items():
    left.bar(sorted(cpu), values, bottom=bottom, label=stage)
    bottom += values
left.set(yscale="log", xlabel="frame", ylabel="CPU time (ms)", title="24 frames by two workers", ylim=(10, None))
left.legend()
energy = ss.open(work / "cluster.zarr")["image/energy"]
decibels = 10 * np.log10(energy[20] / energy[20].max())
shown = right.pcolormesh(energy.azimuth, energy.elevation, decibels, vmin=-30, cmap="inferno")
right.set(title="frame 20", xlabel="azimuth (deg), port on the left", ylabel="elevation (deg)")
right.invert_xaxis()
figure.colorbar(shown, ax=right, label="dB re the brightest beam")
plt.show()
