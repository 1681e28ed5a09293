"""The array expansion: how delay, gain and phase of a path vary over the sensors."""
