"""Contract tests for authors of plug-ins.

``check_effect("my_effect")`` raises a `ContractError` in words, and returns its figures when all is
well. The same checks run from a shell: ``python -m seals.testing effect my_effect``.
"""

from seals.testing.backend import BackendReport, check_backend
from seals.testing.contract import ContractError
from seals.testing.control import ControlReport, check_controller, check_guide
from seals.testing.effect import EffectReport, check_effect
from seals.testing.fluid import FluidReport, check_fluid
from seals.testing.learner import LearnerReport, check_learner
from seals.testing.reader import ReaderReport, check_reader
from seals.testing.robot import RobotReport, check_robot
from seals.testing.sensor import SensorReport, check_sensor
from seals.testing.task import TaskReport, check_task
from seals.testing.waves import WavesReport, check_waves

__all__ = [
    "BackendReport",
    "ContractError",
    "ControlReport",
    "EffectReport",
    "FluidReport",
    "LearnerReport",
    "ReaderReport",
    "RobotReport",
    "SensorReport",
    "TaskReport",
    "WavesReport",
    "check_backend",
    "check_controller",
    "check_effect",
    "check_fluid",
    "check_guide",
    "check_learner",
    "check_reader",
    "check_robot",
    "check_sensor",
    "check_task",
    "check_waves",
]
