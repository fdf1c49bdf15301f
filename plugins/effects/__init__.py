"""Physical effects, one law per file."""
