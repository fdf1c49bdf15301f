"""Learning environments: a task in batch dynamics, or in full worlds."""

from seals.learn.environments.build import batched_of

__all__ = ["batched_of"]
