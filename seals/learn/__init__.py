"""Learning: environments in batches, learners, demonstrations, and statistics that hold."""
