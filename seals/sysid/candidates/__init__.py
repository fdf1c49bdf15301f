"""Parameters and candidate effects that may be added to a stated model, from the registry."""
