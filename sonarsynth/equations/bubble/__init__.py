"""The collapse of a bubble and the pulse that it radiates; other waveforms."""
