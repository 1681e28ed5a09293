"""Tables of the command `accuracy`."""
