"""One frame of a store as one picture."""
