"""Logs with a hidden physical effect, made by a simulator that shares nothing with the package."""
