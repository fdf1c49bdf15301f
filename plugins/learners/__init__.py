"""Learners: algorithms that train a policy from reward or demonstrations."""
