"""Two commits on one machine: the same frames by both, every array compared bit by bit, and their CPU time."""
