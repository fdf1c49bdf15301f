"""A floating box of 0.3 x 0.2 x 0.1 m with 0.7 of the density of water."""
