"""Memory of transitions: returns over several steps, protected demonstrations, priorities."""
