"""Particle water by position-based dynamics; ``water.ParticleWater`` is the door.

Nothing here imports Taichi before ``engine.Engine`` is started.
"""
