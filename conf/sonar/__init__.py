"""Sets of cameras."""
