"""The cascade over a batch: what has no form over it is refused in words."""

from __future__ import annotations

import numpy as np
import pytest

from seals.config.compose import compose
from seals.control.limbs import stowed
from seals.control.plant import build_plant
from seals.errors import ConfigError
from seals.run.assembly import build_model
from seals.run.build import build_run


def test_a_gain_on_the_rate_is_refused() -> None:
    """What has no form over a batch is said, with the allowed value."""
    words = ["robot=aam", "water=fossen", "controller=cascade", "guide=hover"]
    settings = build_run(compose([*words, "controller.rate_gain=[0.1,0.1]"]))
    robot, effects = build_model(settings)
    plant = build_plant(robot, effects, settings.environment)
    with pytest.raises(ConfigError, match="no form over a batch"):
        settings.controller.batched(plant, stowed(robot), np.zeros(1))
