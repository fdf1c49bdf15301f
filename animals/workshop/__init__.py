"""Shared parts of the animals' generator scripts: shells, limbs and three-joint legs."""
