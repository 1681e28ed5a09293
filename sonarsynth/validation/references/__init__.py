"""Independent computations of rays: none shares a formula's code with `sonarsynth.equations`; slow, and short."""
