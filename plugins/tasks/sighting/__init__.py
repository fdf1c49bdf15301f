"""An animal seen by cameras: detector, track, and what a task is told of it."""
