"""Figures of the sound that hydrophones hear, beside its models and a recording."""
