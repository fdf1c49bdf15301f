"""Naming what a model lacks from several runs of one experiment, each re-simulated whole."""
