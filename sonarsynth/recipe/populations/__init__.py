"""Bodies that are drawn anew for each sequence: how many, which, where, how they lie and how they move."""
