"""Replay buffer: n-step returns, protected demonstrations, priorities."""
