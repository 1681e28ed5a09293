"""The pressure of a whole frame, from the equations alone."""
