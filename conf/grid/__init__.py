"""Worlds in which a policy is judged beside its own."""
