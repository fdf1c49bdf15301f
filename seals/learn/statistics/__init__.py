"""Statistics of few seeds and many episodes; NumPy only."""
