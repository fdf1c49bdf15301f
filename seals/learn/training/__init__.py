"""Training: one loop for every learner, with curves, checkpoints and an end in sight."""
