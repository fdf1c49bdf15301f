"""Control: interfaces of guides and controllers, control allocation, state estimates."""

from seals.control.plant import Layout as Layout
from seals.control.plant import Plant as Plant
from seals.control.protocols import ActuatorCommand as ActuatorCommand
from seals.control.protocols import Buoyancy as Buoyancy
from seals.control.protocols import Controller as Controller
from seals.control.protocols import Guide as Guide
from seals.control.protocols import Reference as Reference
from seals.control.protocols import RobotState as RobotState
