"""Actuators: what rotors, thrusters and servos do with a command."""
