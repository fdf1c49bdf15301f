"""Which water: none, or the coefficient model."""
