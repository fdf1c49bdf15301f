"""Controllers: from state and goal to commands."""
