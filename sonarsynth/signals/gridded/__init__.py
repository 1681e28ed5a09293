"""Gridded synthesis (a type-1 non-uniform FFT): its grids, nodes and compiled loops."""
