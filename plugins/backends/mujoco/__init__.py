"""MuJoCo as rigid-body backend: multi-bodies, contacts, joints."""

from seals.plugins.backends.mujoco.backend import BackendMujoco as BackendMujoco
