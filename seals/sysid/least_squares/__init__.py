"""Damped Gauss-Newton steps with priors and bounds."""
