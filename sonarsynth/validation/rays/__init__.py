"""The eigenray search against the references."""
