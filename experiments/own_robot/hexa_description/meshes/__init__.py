"""Files of the example."""
