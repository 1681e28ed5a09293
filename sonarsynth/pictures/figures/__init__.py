"""Functions from arrays to matplotlib figures. Nothing here reads a store; matplotlib is imported when drawing."""
