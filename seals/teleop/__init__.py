"""Teleoperation: devices that a person holds, their keys, and demonstrations made with them."""
