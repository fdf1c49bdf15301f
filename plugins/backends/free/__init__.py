"""Rigid bodies in free motion: joints and servos, but no contacts; needs no engine."""

from seals.plugins.backends.free.backend import BackendFree as BackendFree
