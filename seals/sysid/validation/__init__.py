"""Model overlays from a diagnosis, and their verification on held-out logs."""
