"""MuJoCo Warp as rigid-body backend: thousands of worlds with contacts on one GPU."""

from seals.plugins.backends.mujoco_warp.backend import BackendMujocoWarp as BackendMujocoWarp
