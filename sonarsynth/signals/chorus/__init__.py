"""How a chorus of snaps reaches the array, and what the hydrophones hear of it."""
