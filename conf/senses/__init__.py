"""Sets of sensors beside cameras."""
