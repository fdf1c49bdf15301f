"""A rover of 40 kg with four driven wheels that floats and swims with two thrusters."""
