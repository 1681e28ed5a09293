"""Collapsing bubbles against series, closed forms and what is conserved."""
