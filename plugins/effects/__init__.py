"""Physical effects, one law a file."""
