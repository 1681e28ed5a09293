"""Taking the direct pulse and its reflections out of the signals."""
