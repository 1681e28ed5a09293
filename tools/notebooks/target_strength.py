# ---
# jupyter:
#   jupytext:
#     text_representation: {extension: .py, format_name: percent}
# ---

# %% [markdown]
# # Target strength against exact series
#
# A sphere is a body whose scattering is known exactly, as a series of modes (Faran 1951). This page compares it with
# what facets give: Kirchhoff's integral over flat triangles, which frames use, for a rigid and a soft sphere.

# %%
import matplotlib.pyplot as plt
import numpy as np

import sonarsynth as ss
from sonarsynth.equations.scattering.modal_series import sphere_amplitude

radius, speed = 0.25, 1500.0
sphere = ss.Sphere(radius=radius)

# %% [markdown]
# ## Backscatter over frequency
#
# At high frequencies a sphere sends back 20 log10(radius/2), like a mirror. The exact curve swings about that by waves
# that creep round the sphere, which facets do not have; ka is wavenumber times radius.

# %%
frequency = np.linspace(5e3, 110e3, 106)
ahead = np.array([1.0, 0.0, 0.0])
exact = {
    kind: 20 * np.log10(np.abs(sphere_amplitude(frequency, np.pi, radius=radius, boundary=kind)))
    for kind in ("rigid", "soft")
}
laws = {"rigid": ss.Kirchhoff(surface="rigid"), "soft": ss.Kirchhoff(surface="soft")}
facets = {kind: ss.target_strength(sphere, frequency, ahead, -ahead, speed, laws[kind]) for kind in exact}
high = frequency > 25e3
for kind in exact:
    error = np.abs(facets[kind] - exact[kind])[high].max()
    print(f"{kind}: backscatter within {error:.2f} dB of the series from 25 to 110 kHz")

# %% [markdown]
# ## Over angle, at 60 kHz
#
# 180 degrees is backscatter, 0 is forward, where a body makes its shadow.

# %%
angle = np.deg2rad(np.linspace(2.0, 180.0, 179))
away = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
series = 20 * np.log10(np.abs(sphere_amplitude(60e3, angle, radius=radius)))
flat = ss.target_strength(sphere, 60e3, ahead, away, speed, laws["rigid"])
back = angle > np.deg2rad(60)
print(f"60 kHz, up to 120 degrees off backscatter: within {np.abs(flat - series)[back].max():.2f} dB")

# %%
figure, (left, middle, right) = plt.subplots(1, 3, figsize=(15, 4.4), layout="constrained")
for kind, colour in (("rigid", "tab:blue"), ("soft", "tab:orange")):
    left.plot(frequency / 1e3, exact[kind], color=colour, label=f"{kind}, series")
    left.plot(frequency / 1e3, facets[kind], "--", color=colour, label=f"{kind}, facets")
left.axhline(20 * np.log10(radius / 2), color="grey", linewidth=0.8, label="20 log10(radius/2)")
left.set(title="backscatter of a sphere of 25 cm", xlabel="frequency (kHz)", ylabel="target strength (dB re 1 m2)")
left.legend(fontsize="small")
twin = left.secondary_xaxis(
    "top", functions=(lambda f: 2e3 * np.pi * f / speed * radius, lambda ka: ka * speed / (2e3 * np.pi * radius))
)
twin.set_xlabel("ka")
middle.plot(np.rad2deg(angle), series, label="series")
middle.plot(np.rad2deg(angle), flat, "--", label="facets")
middle.set(title="rigid, 60 kHz", xlabel="angle off the incident way (deg)", ylabel="target strength (dB re 1 m2)")
middle.legend()
right.plot(np.rad2deg(angle), flat - series)
right.set(title="facets less series, 60 kHz", xlabel="angle off the incident way (deg)", ylabel="dB", ylim=(-2, 2))
plt.show()
