"""Scores of fitted models: Laplace evidence and cross-validation."""
