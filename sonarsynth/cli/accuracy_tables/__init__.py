"""Tables of `sonarsynth accuracy`: error against run time, and extreme cases."""
