"""Lockstep with an external autopilot that flies a simulated robot."""
