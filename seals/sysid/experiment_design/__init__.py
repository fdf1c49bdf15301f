"""Experiment design: choice of the manoeuvre that tells effects apart or makes one observable."""
