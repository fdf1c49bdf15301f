"""SEALS: simulation of robots in air, in water and on land, and diagnosis of missing effects.

The names below are part of the public interface, whose rule of stability stands on the page of the
public names. Modules and names that are not listed here may move. A name is imported when it is
first used, so ``import seals`` costs little.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from seals.api import list_plugins as list_plugins
    from seals.api import load_log as load_log
    from seals.api import load_logs as load_logs
    from seals.api import load_robot as load_robot
    from seals.api import make as make
    from seals.api import make_batch as make_batch
    from seals.api import simulate as simulate
    from seals.arrays import Array as Array
    from seals.arrays import columns as columns
    from seals.arrays import namespace as namespace
    from seals.batch import BatchDynamics as BatchDynamics
    from seals.control.allocation import Allocation as Allocation
    from seals.control.plant import Plant as Plant
    from seals.control.protocols import ActuatorCommand as ActuatorCommand
    from seals.control.protocols import ControllerOptions as ControllerOptions
    from seals.control.protocols import Goal as Goal
    from seals.control.protocols import Reference as Reference
    from seals.control.protocols import RobotState as RobotState
    from seals.effects.effect import Effect as Effect
    from seals.effects.effect import MediumKind as MediumKind
    from seals.effects.effect import Parameters as Parameters
    from seals.effects.identification import Identification as Identification
    from seals.errors import ConfigError as ConfigError
    from seals.errors import LogError as LogError
    from seals.errors import PhysicsError as PhysicsError
    from seals.errors import RobotError as RobotError
    from seals.errors import SealsError as SealsError
    from seals.frames import cross as cross
    from seals.logs.log import Log as Log
    from seals.logs.native import write_native as write_log  # noqa: F401  listed in __all__
    from seals.motion import Inputs as Inputs
    from seals.motion import Joints as Joints
    from seals.motion import Medium as Medium
    from seals.motion import Motion as Motion
    from seals.motion import Wrench as Wrench
    from seals.motion import by_joint as by_joint
    from seals.robot.model import RobotModel as RobotModel
    from seals.schema import param as param
    from seals.schema import setting as setting
    from seals.sensors.instrument import Instrument as Instrument
    from seals.sensors.noise import Noise as Noise
    from seals.sensors.protocol import SensorInput as SensorInput
    from seals.state_records import state_record as state_record
    from seals.sysid.calibration.estimator import Calibrator as Calibrator
    from seals.sysid.calibration.estimator import calibrate as calibrate
    from seals.sysid.report.estimator import MissingEffect as MissingEffect
    from seals.testing.control import check_controller as check_controller
    from seals.testing.control import check_guide as check_guide
    from seals.testing.effect import check_effect as check_effect
    from seals.testing.reader import check_reader as check_reader
    from seals.testing.sensor import check_sensor as check_sensor
    from seals.testing.task import check_task as check_task
    from seals.world.ledger import Ledger as Ledger
    from seals.world.world import World as World

__version__ = "0.1.0"

_HOMES = {
    "make": "seals.api",
    "make_batch": "seals.api",
    "simulate": "seals.api",
    "World": "seals.world.world",
    "BatchDynamics": "seals.batch",
    "Ledger": "seals.world.ledger",
    "load_robot": "seals.api",
    "RobotModel": "seals.robot.model",
    "MissingEffect": "seals.sysid.report.estimator",
    "calibrate": "seals.sysid.calibration.estimator",
    "Calibrator": "seals.sysid.calibration.estimator",
    "load_log": "seals.api",
    "load_logs": "seals.api",
    "write_log": "seals.logs.native:write_native",
    "Log": "seals.logs.log",
    "Effect": "seals.effects.effect",
    "param": "seals.schema",
    "setting": "seals.schema",
    "check_effect": "seals.testing.effect",
    "Instrument": "seals.sensors.instrument",
    "SensorInput": "seals.sensors.protocol",
    "Noise": "seals.sensors.noise",
    "check_sensor": "seals.testing.sensor",
    "Allocation": "seals.control.allocation",
    "Plant": "seals.control.plant",
    "ActuatorCommand": "seals.control.protocols",
    "ControllerOptions": "seals.control.protocols",
    "Goal": "seals.control.protocols",
    "Reference": "seals.control.protocols",
    "RobotState": "seals.control.protocols",
    "state_record": "seals.state_records",
    "check_controller": "seals.testing.control",
    "check_guide": "seals.testing.control",
    "check_task": "seals.testing.task",
    "check_reader": "seals.testing.reader",
    "MediumKind": "seals.effects.effect",
    "Parameters": "seals.effects.effect",
    "Identification": "seals.effects.identification",
    "Array": "seals.arrays",
    "namespace": "seals.arrays",
    "columns": "seals.arrays",
    "Motion": "seals.motion",
    "Medium": "seals.motion",
    "Joints": "seals.motion",
    "by_joint": "seals.motion",
    "Inputs": "seals.motion",
    "Wrench": "seals.motion",
    "cross": "seals.frames",
    "list_plugins": "seals.api",
    "SealsError": "seals.errors",
    "ConfigError": "seals.errors",
    "LogError": "seals.errors",
    "RobotError": "seals.errors",
    "PhysicsError": "seals.errors",
}
"""Module of each public name, with ``:name`` where it is called otherwise there."""

__all__ = ["__version__", *_HOMES]  # noqa: PLE0604  strings, read from the table

if not TYPE_CHECKING:  # a type checker reads the imports above instead

    def __getattr__(name: str) -> object:
        """Import a public name when it is first used."""
        if name not in _HOMES:
            raise AttributeError(f"module 'seals' has no attribute '{name}'")
        module, _, attribute = _HOMES[name].partition(":")
        found = getattr(import_module(module), attribute or name)
        globals()[name] = found
        return found

    def __dir__() -> list[str]:
        """Return the public names beside those already imported."""
        return sorted({*globals(), *__all__})
