"""Comparison of the arms of a study, from the tables of their training runs."""
