"""Learners: from data or reward to a policy."""
