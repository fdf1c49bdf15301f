"""Physical effects, one law per file.

A force on links is the hook `loads` (example `linear_drag`), one on joints the hook `joint_loads`
(example `joint_friction`); `seals.effects.effect.Effect` lists all hooks.
"""
