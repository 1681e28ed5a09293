"""Sources of sound: snapping shrimp and their snaps."""
