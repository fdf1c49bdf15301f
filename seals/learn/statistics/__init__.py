"""Statistics of training runs with few seeds: intervals, tests, curves."""
