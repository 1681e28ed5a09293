"""What a plan measures in a few frames before it chooses."""
