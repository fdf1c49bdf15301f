"""Robots of the user's own, several logs of each, effects that begin and end."""
