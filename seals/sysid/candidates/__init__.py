"""Parameters and candidate effects that may be added to a nominal model, from the registry."""
