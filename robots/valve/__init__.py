"""A valve with a lever that a hand turns."""
