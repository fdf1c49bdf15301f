"""Configuration by Hydra: schemas from plug-in classes, composition, construction.

Where to start: ``compose.compose`` turns override strings into a composed configuration and
``build.build`` one node into an object. The typed settings of a verb lie beside its code
(``roots`` says where); those of a run are built by `seals.run.build.build_run`.
"""
