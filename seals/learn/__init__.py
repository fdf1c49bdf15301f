"""Learning: batched environments, learners, demonstrations, evaluation, statistics."""
