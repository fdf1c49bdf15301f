"""Actuators: force models of rotors, thrusters and servos."""
