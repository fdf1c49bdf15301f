"""Contract tests for authors of plug-ins.

``check_effect("my_effect")`` raises a `ContractError` in words, and returns its figures when all is
well. The same checks run from a shell: ``python -m seals.testing effect my_effect``.
"""

from seals.contract import ContractError as ContractError
from seals.testing.backend import BackendReport as BackendReport
from seals.testing.backend import check_backend as check_backend
from seals.testing.control import ControlReport as ControlReport
from seals.testing.control import check_controller as check_controller
from seals.testing.control import check_guide as check_guide
from seals.testing.effect import EffectReport as EffectReport
from seals.testing.effect import check_effect as check_effect
from seals.testing.fluid import FluidReport as FluidReport
from seals.testing.fluid import check_fluid as check_fluid
from seals.testing.learner import LearnerReport as LearnerReport
from seals.testing.learner import check_learner as check_learner
from seals.testing.reader import ReaderReport as ReaderReport
from seals.testing.reader import check_reader as check_reader
from seals.testing.robot import RobotReport as RobotReport
from seals.testing.robot import check_robot as check_robot
from seals.testing.sensor import SensorReport as SensorReport
from seals.testing.sensor import check_sensor as check_sensor
from seals.testing.task import TaskReport as TaskReport
from seals.testing.task import check_task as check_task
from seals.testing.waves import WavesReport as WavesReport
from seals.testing.waves import check_waves as check_waves
