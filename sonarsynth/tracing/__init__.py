"""From the state of the world to arrivals: every path of a frame, out to a facet and back to the array."""
