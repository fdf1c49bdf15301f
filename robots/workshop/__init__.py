"""Generators of the robots' URDFs and meshes: pieces, links, files."""
