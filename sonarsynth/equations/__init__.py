"""The equations: pure functions of arrays, each with its source; testable without building a scene."""
