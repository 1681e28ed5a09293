"""Noise that hydrophones hear together, drawn: on lattices, and at hydrophones anywhere."""
