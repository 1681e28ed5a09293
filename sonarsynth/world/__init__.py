"""What there is: water with its surface and bed, targets that move, and snapping shrimp."""
