"""Environments of learning: one task in twins on any device, or in full worlds."""

from seals.learn.environments.build import batched_of

__all__ = ["batched_of"]
