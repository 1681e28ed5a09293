"""What a user should know of a plan before it is built."""
