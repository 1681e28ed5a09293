"""Scattering by facets, smooth bodies and rough surfaces; exact series."""
