"""Commands on detectors: to run a baseline, and to judge what any detector found."""
