# ---
# jupyter:
#   jupytext:
#     text_representation: {extension: .py, format_name: percent}
# ---

# %% [markdown]
# # Open a store with xarray and dask alone
#
# A dataset is one Zarr store. Reading it needs xarray, zarr and dask, and nothing of sonarsynth. This page lays out
# a dataset of 1500 frames, builds four of them, and reads it lazily, in pieces, and by URL.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr

import sonarsynth as ss

here = Path.cwd()
root = next(folder for folder in (here, *here.parents) if (folder / "configs" / "remus.yaml").is_file())
work = Path(tempfile.mkdtemp())

# %% [markdown]
# ## Build a few frames of a long dataset
#
# The whole store is laid out first, so its size is that of all frames. Frames that are not built yet read as NaN or
# -1, never as 0, and the same command builds them later.

# %%
recipe = ss.load(root / "configs" / "remus.yaml", ["scene.trajectory.frames=1500", "scene.trajectory.interval=4 ms"])
frames = range(1000, 1004)
report = ss.build(recipe, work / "remus.zarr", frames=frames, workers=0)
print(f"{report.written} of {report.frames} frames built")

# %% [markdown]
# ## Open it lazily
#
# `chunks={}` gives dask arrays with the chunks of the store, of one frame each. Nothing is read yet: the signals of
# all frames would not fit in the memory of most machines.

# %%
store = xr.open_datatree(work / "remus.zarr", engine="zarr", chunks={})
pressure = store["signals/pressure"]
print(f"{pressure.sizes['frame']} frames x {pressure.sizes['sensor']} hydrophones x {pressure.sizes['sample']} samples")
print(f"all of it: {pressure.nbytes / 1e9:.0f} GB; one chunk: {pressure.nbytes / pressure.sizes['frame'] / 1e6:.0f} MB")

# %%
energy = store["image/energy"]
beams = energy.sel(azimuth=slice(-10, 10), elevation=slice(-5, 5)).isel(frame=slice(1000, 1004))
brightest = beams.max(["azimuth", "elevation"])  # a graph of tasks
print(brightest.compute().values)  # reads four chunks

# %% [markdown]
# ## Larger than memory
#
# A reduction holds a few chunks at a time. The same line works on a thousand frames, or on all of them.

# %%
some = pressure.isel(frame=slice(1000, 1004))
level = 20 * np.log10(np.sqrt((some**2).mean(["sensor", "sample"])) / 1e-6)
print("level in each frame (dB re 1 uPa):", level.compute().values.round(1))

# %% [markdown]
# ## By URL
#
# The path may be any URL that fsspec knows: `file://`, `s3://` (with `sonarsynth[remote]`); HTTPS is read only.

# %%
remote = xr.open_datatree((work / "remus.zarr").as_uri(), engine="zarr", chunks={})
same = remote["image/energy"].isel(frame=1003)
assert np.array_equal(same, energy.isel(frame=1003))

figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained")
decibels = (10 * np.log10(same / same.max())).assign_attrs(long_name="energy re the brightest beam", units="dB")
decibels.plot(ax=left, vmin=-40, cmap="inferno", xincrease=False)
left.set_title("image of frame 1003, port on the left")
loudest = np.abs(some.isel(frame=3)).max("sample").argmax("sensor").compute()
some.isel(frame=3, sensor=loudest).plot(ax=right, x="time", linewidth=0.6)
right.set_title(f"signal of hydrophone {int(loudest)}")
plt.show()
