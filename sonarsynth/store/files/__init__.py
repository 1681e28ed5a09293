"""The files of a store: on a disk or at a URL, their locks, and what is never followed."""
