"""A boat of 24 kg with two thrusters."""
