"""The sea: depth, sound speed, absorption, surface, bottom and ambient noise."""
