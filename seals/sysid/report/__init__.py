"""Report of a diagnosis: HTML page, ranked table, and JSON."""
