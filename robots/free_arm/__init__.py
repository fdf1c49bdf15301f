"""A free body with two swinging links, off-centre mass and tilted principal axes."""
