"""Replay memory: n-step returns, protected demonstrations, priorities."""
