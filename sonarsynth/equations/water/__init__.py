"""Sea water and its boundaries."""
