"""Evaluation of policies from held-out initial states, in the training world and others."""
