"""A rover of 1 kg with two driven wheels and a caster."""
