"""A shore crab that runs on three pairs of legs."""
