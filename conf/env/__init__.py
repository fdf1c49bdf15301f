"""Environments of learning, whole recipes: ``env=reach``."""
