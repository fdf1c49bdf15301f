"""Templates of the files that `seals new` writes."""
