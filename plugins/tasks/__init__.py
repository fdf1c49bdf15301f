"""Tasks: goal, reward and end of an episode."""
