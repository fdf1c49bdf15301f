"""PyBullet as rigid-body backend: multi-bodies, contacts, joints."""

from seals.plugins.backends.pybullet.backend import BackendPybullet

__all__ = ["BackendPybullet"]
