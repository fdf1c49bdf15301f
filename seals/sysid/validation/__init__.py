"""Model overlays from a diagnosis, and their verification on logs that no fit saw."""
