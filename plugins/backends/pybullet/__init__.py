"""PyBullet as rigid-body backend: multi-bodies, contacts, joints."""

from seals.plugins.backends.pybullet.backend import BackendPybullet as BackendPybullet
