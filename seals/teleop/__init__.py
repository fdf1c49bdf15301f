"""Teleoperation: input devices, sessions, and demonstrations recorded in them."""
