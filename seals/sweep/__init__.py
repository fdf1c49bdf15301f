"""Sweeps: many jobs by one command, with a job log, progress and resumption."""
