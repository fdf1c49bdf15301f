"""Sensor base classes: mounting, noise, latency, dropouts, and the inputs of a sensor."""
