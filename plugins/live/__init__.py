"""Live outputs: stream the state of a running simulation to other programs."""
