"""Benchmarks: run by tools/bench."""
