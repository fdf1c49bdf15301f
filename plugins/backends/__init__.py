"""Rigid-body backends: engines that integrate the motion of the links."""
