"""Learners with other hyper-parameters."""
