"""Delay and sum: on a lattice by rows and columns, in any array sensor by sensor, and the choice between the two."""
