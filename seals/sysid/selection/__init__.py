"""Search for the set of candidate effects with the best score."""
