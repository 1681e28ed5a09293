"""Independent computations of rays: none shares a formula's code with `sonarsynth.acoustics`; slow, and short."""
