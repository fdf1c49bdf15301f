"""A single pendulum on a fixed pivot, angle zero when hanging."""
