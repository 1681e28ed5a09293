"""Whether a store is as it was written, and putting it right."""
