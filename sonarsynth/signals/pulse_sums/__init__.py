"""Sums of many short pulses of one shape at every sensor: of a chorus, of reverberation."""
