"""What compiled kernels share: vectors of floats, phasors, products of rows."""
