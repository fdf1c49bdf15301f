"""Experiment design: the manoeuvre that separates effects best, or shows one at all."""
