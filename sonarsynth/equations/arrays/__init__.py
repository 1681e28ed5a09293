"""Arrays: apertures, beams, and the fit of a spherical wave."""
