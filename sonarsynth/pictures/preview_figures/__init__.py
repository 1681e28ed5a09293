"""What a recipe would make, drawn before it is built."""
