"""Evaluation of policies on held-out initial states, in their own world and in others."""
