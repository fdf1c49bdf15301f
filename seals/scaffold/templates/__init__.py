"""Templates of what `seals new` writes."""
