"""Spectra of noise, filters, and sums of power."""
