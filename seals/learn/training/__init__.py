"""Training: loop common to all learners, learning curves, checkpoints."""
