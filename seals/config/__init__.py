"""Typed configuration: the class of a plug-in is its schema, Hydra composes, ``build`` constructs.

Where to start: ``compose.compose`` turns override strings into a composed configuration,
``run.build_run`` a composed run into typed settings, ``build.build`` one node into an object.
"""
