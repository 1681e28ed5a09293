# ---
# jupyter:
#   jupytext:
#     text_representation: {extension: .py, format_name: percent}
# ---

# %% [markdown]
# # Beam pattern, grating lobes and focus
#
# What an array can tell is in its beam pattern. This page computes that of a lattice of 20 by 16 hydrophones, 5 cm
# apart, by its definition: the sum of the hydrophones' phases. Then a frame shows the same in an image.

# %%
import matplotlib.pyplot as plt
import numpy as np

import sonarsynth as ss

speed, pitch = 1500.0, 0.05
lattice = ss.PlanarLattice(columns=20, rows=16, pitch=pitch)
from sonarsynth.receiver import elements  # noqa: E402

position = elements(lattice).position  # (sensor, xyz) m, sonar frame


def pattern(frequency, azimuth, steered=0.0):
    """Level (azimuth,) in dB of a plane wave from azimuths (rad), of the beam steered to one, through the faces."""
    wave = 2 * np.pi * frequency / speed
    u = np.stack([np.cos(azimuth), np.sin(azimuth), 0 * azimuth], axis=-1)
    s = np.array([np.cos(steered), np.sin(steered), 0.0])
    beam = np.mean(np.exp(1j * wave * (u - s) @ position.T), axis=-1)
    return 20 * np.log10(np.abs(beam * np.sinc(wave * pitch * np.sin(azimuth) / (2 * np.pi))) + 1e-12)


# %% [markdown]
# ## One frequency
#
# The first null is at wavelength over width. Where the pitch is over half a wavelength, there are directions that the
# hydrophones cannot tell from each other, sin(azimuth) = sin(steered) + n wavelength/pitch: the grating lobes. The
# faces of the hydrophones, as wide as the pitch, have a null there for the beam ahead, not for one steered aside.

# %%
azimuth = np.deg2rad(np.linspace(-90, 90, 3601))
wavelength = speed / 60e3
first_null = np.rad2deg(np.arcsin(wavelength / (20 * pitch)))
lobe = np.rad2deg(np.arcsin(np.sin(np.deg2rad(15)) - wavelength / pitch))
aside = pattern(60e3, azimuth, np.deg2rad(15))
near = np.abs(np.rad2deg(azimuth) - lobe) < 3
print(f"first null by wavelength/width: {first_null:.2f} deg")
found = np.rad2deg(azimuth[near][aside[near].argmax()])
print(f"grating lobe of 15 deg: by the equation {lobe:.1f} deg, in the pattern {found:.1f} deg")

# %% [markdown]
# ## A band smears grating lobes
#
# Each frequency has its lobes elsewhere; a snap has all frequencies from 25 to 85 kHz, so that their energy spreads.

# %%
band = np.linspace(25e3, 85e3, 61)
smeared = 10 * np.log10(np.mean([10 ** (0.1 * pattern(f, azimuth, np.deg2rad(15))) for f in band], axis=0))

# %% [markdown]
# ## Focus
#
# Waves from nearby are curved. An array that is focused at one range loses level of a source at another. That is the
# loss of a source ahead, of arrays focused at 5 m, at 20 m and at infinity, at 85 kHz.

# %%
ranges = np.geomspace(1.5, 200.0, 300)


def focused(focus):
    """Loss (range,) in dB of a source ahead at each range, of an array focused at one (m)."""
    wave = 2 * np.pi * 85e3 / speed
    way = np.linalg.norm(ranges[:, None, None] * np.array([1.0, 0, 0]) - position, axis=-1) - ranges[:, None]
    at = np.linalg.norm(focus * np.array([1.0, 0, 0]) - position, axis=-1) - focus if np.isfinite(focus) else 0.0
    return 20 * np.log10(np.abs(np.mean(np.exp(1j * wave * (way - at)), axis=-1)))


# %% [markdown]
# ## In an image
#
# A sphere 15 degrees to port, 10 m off. Its grating lobe lies where the pattern says, smeared by the band. The same by
# `sub_band`, the geometric mean of images of parts of the band, which takes grating lobes away.

# %%
recipe = """
scene:
  world:
    environment: {{depth: 20 m, sound_speed: {{kind: isovelocity, speed: 1500 m/s}}}}
    targets:
      - {{name: ball, shape: {{kind: sphere, radius: 20 cm}}, motion: {{kind: still, position: [9.66, 2.59, -10]}}}}
    sources: [{{kind: snapping_shrimp, position: [5, -3]}}]
  sonar:
    array: {{kind: planar_lattice, columns: 20, rows: 16, pitch: 5 cm}}
    assumed_sound_speed: 1500 m/s
    beams: {{azimuth_span: 80 deg, azimuths: 161, elevation_span: 20 deg, elevations: 41}}
  trajectory: {{frames: 1, sonar: {{kind: still, position: [0, 0, -10], heading: 90 deg}}}}
  processing: {{beamforming: {{kind: {kind}}}}}
"""
images = {kind: ss.render(ss.loads(recipe.format(kind=kind)), 0)["image/energy"] for kind in ("focused", "sub_band")}

# %%
figure, axes = plt.subplots(2, 2, figsize=(13, 8.5), layout="constrained")
axes[0, 0].plot(np.rad2deg(azimuth), pattern(60e3, azimuth), label="60 kHz, ahead")
axes[0, 0].plot(np.rad2deg(azimuth), aside, label="60 kHz, steered to 15 deg")
axes[0, 0].plot(np.rad2deg(azimuth), smeared, "k", label="25 to 85 kHz, steered to 15 deg")
axes[0, 0].axvline(lobe, color="grey", linestyle=":", label="grating lobe by the equation")
axes[0, 0].set(
    title="beam pattern", xlabel="azimuth (deg), port on the left", ylabel="dB", xlim=(90, -90), ylim=(-50, 2)
)
axes[0, 0].legend(fontsize="small", loc="lower center")
for focus, name in ((5.0, "5 m"), (20.0, "20 m"), (np.inf, "infinity")):
    axes[0, 1].semilogx(ranges, focused(focus), label=f"focused at {name}")
axes[0, 1].set(title="loss out of focus, 85 kHz", xlabel="range of the source (m)", ylabel="dB", ylim=(-12, 1))
axes[0, 1].legend()
for place, (kind, energy) in zip(axes[1], images.items(), strict=True):
    shown = place.pcolormesh(
        energy.azimuth, energy.elevation, 10 * np.log10(energy / energy.max()), vmin=-40, cmap="inferno"
    )
    place.set(title=f"image, {kind}", xlabel="azimuth (deg), port on the left", ylabel="elevation (deg)")
    place.invert_xaxis()
    figure.colorbar(shown, ax=place, label="dB re the brightest beam")
plt.show()
