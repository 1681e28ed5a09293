# ---
# jupyter:
#   jupytext:
#     text_representation: {extension: .py, format_name: percent}
# ---

# %% [markdown]
# # A hull from clouds
#
# One frame gives a few points of what faces the sonar and is lit by the snap. A body that turns shows all its sides.
# This page fuses the points of two turns of a hull, and makes a surface of them. Where the body was and how it lay is
# taken from the truth, as if it had kept a log; all else is what the sonar heard.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import trimesh
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree

import sonarsynth as ss

folder = Path(tempfile.mkdtemp())
lying = trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0])
body = trimesh.creation.capsule(height=1.6, radius=0.3).apply_transform(lying)
sail = trimesh.creation.box((0.4, 0.12, 0.3)).apply_translation([0.2, 0, 0.42])
trimesh.util.concatenate([body, sail]).export(folder / "hull.stl")

# %% [markdown]
# ## Two turns
#
# The hull turns on the spot, 24 degrees from frame to frame. In the first turn the snap is to the left on the bottom
# and the hull is higher than the sonar, in the second the snap is to the right near the surface and the hull is lower.

# %%
recipe = ss.loads(f"""
scene:
  world:
    environment:
      depth: 9 m
      sound_speed: {{kind: isovelocity, speed: 1535 m/s}}
      noise: {{kind: flat, level: 40 dB}}
    targets:
      - name: hull
        shape: {{kind: mesh_file, path: {folder / "hull.stl"}, unit: m, edge: 10 cm}}
        motion: {{kind: circle, centre: [10, 0, -4.2], radius: 1 mm, speed: 0.001 m/s}}
    sources: [{{kind: snapping_shrimp, position: [5, 4], source_level: 190 dB}}]
  sonar:
    array: {{kind: planar_lattice, columns: 16, rows: 16, pitch: 5 cm}}
    assumed_sound_speed: 1535 m/s
    beams: {{azimuth_span: 24 deg, azimuths: 49, elevation_span: 24 deg, elevations: 49}}
  trajectory: {{frames: 15, interval: 0.41888 s, sonar: {{kind: still, position: [0, 0, -5], heading: 90 deg}}}}
  physics: {{scattering: {{kind: mirror_lobe, width: 40 deg}}}}
accuracy: {{signal: 0.05}}
grid:
  - zip:
      - {{name: snap, path: scene.world.sources.0.position, values: [[5, 4], [6, -5, -1]]}}
      - {{name: depth, path: scene.world.targets.0.motion.centre.2, values: [-4.2, -6]}}
""")
ss.build(ss.plan(recipe, products=("cloud",)), folder / "turns.zarr", workers=0)
store = ss.open(folder / "turns.zarr")
points = ss.points(store, relative_to="hull")
place, frame = points["position"].values, points["frame"].values
print(f"{len(place)} points of {recipe.frames} frames")

# %% [markdown]
# ## Points that stand alone are left out
#
# Side lobes and echoes on top of each other give points beside the hull. The sonar cannot know which; that a point has
# no neighbours tells against it. The labels of the truth say how little that helps here: few points are left out, and
# most of the wrong ones lie among others.

# %%
lonely = cKDTree(place).query(place, 6)[0].mean(axis=1)
kept = lonely < 2 * np.median(lonely)
echoes = points["origin"].values == 0  # heard by the main lobe, from the truth
print(f"kept: {np.sum(kept & echoes)} right, {np.sum(kept & ~echoes)} wrong")
print(f"left out: {np.sum(~kept & echoes)} right, {np.sum(~kept & ~echoes)} wrong")

# %% [markdown]
# ## A surface
#
# The normal of a point is that of the plane through its neighbours. A function of space that is 0 at the points, and a
# distance away along their normals just that distance, is the surface where it is 0 (Carr et al. 2001).


# %%
def surface(place, neighbours=12, step=0.05):
    """A function of places (place, xyz) in m: about the distance from the surface of points, within it negative."""
    near = place[cKDTree(place).query(place, neighbours)[1]]
    normal = np.linalg.svd(near - near.mean(axis=1, keepdims=True), full_matrices=False)[2][:, 2]
    outwards = (place - place.mean(axis=0)) * [0.3, 1.0, 1.0]  # the hull is long
    normal *= np.sign(np.sum(normal * outwards, axis=1))[:, None]
    known = np.concatenate([place, place + step * normal, place - step * normal])
    values = np.repeat([0.0, step, -step], len(place))
    return RBFInterpolator(known, values, kernel="linear", smoothing=0.5)


# %% [markdown]
# ## How far it lies from the true hull
#
# Along the normal of the true hull, at 400 random places of it. Half a hull is not seen by a sonar that has it before
# it for one frame; with more frames the surface closes.

# %%
mesh = store["targets/hull"].dataset
true = trimesh.Trimesh(mesh["vertices"].values, mesh["faces"].values, process=False)
sample, facet = trimesh.sample.sample_surface(true, 400, seed=1)
along = np.linspace(-0.3, 0.3, 25)
ways = (sample[:, None] + along[:, None] * true.face_normals[facet][:, None]).reshape(-1, 3)


def deviation(function):
    """Of each place of the true hull the distance (m) of the surface along the normal, NaN beyond 30 cm."""
    value = function(ways).reshape(len(sample), len(along))
    low, high = value[:, :-1], value[:, 1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        met = np.where((low < 0) & (high >= 0), along[:-1] - low * (along[1] - along[0]) / (high - low), np.inf)
    nearest = met[np.arange(len(met)), np.abs(met).argmin(axis=1)]
    return np.where(np.isfinite(nearest), nearest, np.nan)


results = {}
for frames in (8, 15, 30):
    first = kept & (frame < frames)
    off = np.abs(deviation(surface(place[first])))
    results[frames] = np.sum(first), np.nanmedian(off), np.mean(off < 0.05), np.mean(off < 0.1)
    print(f"{frames:2d} frames, {np.sum(first):3d} points: median {100 * np.nanmedian(off):.1f} cm, ", end="")
    print(f"{np.mean(off < 0.05):.0%} of the hull within 5 cm")

# %%
whole = surface(place[kept])
x, z = np.meshgrid(np.linspace(-1.4, 1.4, 113), np.linspace(-0.6, 0.8, 57))
figure, axes = plt.subplots(2, 2, figsize=(13, 8.4), layout="constrained")
cuts = {
    "along the middle, side view": (0, 2, lambda u, v: np.stack([u, 0 * u, v], -1), [0, 1, 0], 0.0),
    "through the waterline, from above": (0, 1, lambda u, v: np.stack([u, v, 0 * u], -1), [0, 0, 1], 0.0),
    "across the sail": (1, 2, lambda u, v: np.stack([0 * u + 0.2, u, v], -1), [1, 0, 0], 0.2),
}
for panel, (title, (u, v, grid, normal, at)) in zip(axes.flat, cuts.items(), strict=False):
    across = np.abs(place @ np.array(normal) - at) < 0.12
    for some, colour, label in ((kept, "tab:blue", "points, 12 cm beside at most"), (~kept, "0.6", "left out")):
        panel.plot(place[across & some, u], place[across & some, v], ".", color=colour, markersize=5, label=label)
    panel.contour(x, z, whole(grid(x, z).reshape(-1, 3)).reshape(x.shape), [0.0], colors="tab:red")
    panel.plot([], [], color="tab:red", label="surface of the points")
    lines = trimesh.intersections.mesh_plane(true, normal, np.array(normal) * at)
    panel.plot(*lines[..., [u, v]].transpose(2, 1, 0), color="black", linewidth=1.0)
    panel.plot([], [], color="black", linewidth=1.0, label="true hull")
    names = ("forward (m)", "to port (m)", "up (m)")
    panel.set(title=title, aspect="equal", xlabel=names[u], ylabel=names[v], xlim=(-1.4, 1.4), ylim=(-0.6, 0.8))
axes[0, 0].legend(fontsize="small", loc="upper left", ncols=2)
axes[1, 1].plot(list(results), [100 * r[2] for r in results.values()], "o-", label="within 5 cm")
axes[1, 1].plot(list(results), [100 * r[3] for r in results.values()], "o-", label="within 10 cm")
axes[1, 1].set(title="the true hull that is met", xlabel="frames", ylabel="share of its surface (%)", ylim=(0, 100))
axes[1, 1].legend()
plt.show()
