"""Quantities of full worlds for observations and rewards: grip, contact, leg phases, slip."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from seals.arrays import Floats
from seals.backend import BodyOptions
from seals.environment.settings import EnvironmentSettings
from seals.errors import ConfigError, refuse_unlisted
from seals.plugin_options import options_of
from seals.world import Actor


class Facts:
    """Quantities of one robot by name, averaged over the steps of a control step.

    Args:
        names: of the facts that are wanted.
        actor: the robot.
        environment: with the water level.
        thing: object that is the target, or None.

    Attributes:
        stepwise: whether any of them is found from every step of the world, see `observe`.

    Raises:
        ConfigError: there is no such fact, or the robot or the backend has not what it needs.
    """

    def __init__(
        self,
        names: Sequence[str],
        actor: Actor,
        environment: EnvironmentSettings,
        thing: Actor | None = None,
    ) -> None:
        """Look up the requested quantities."""
        kinds: Mapping[str, Callable[[], Floats]] = {
            "grip": self._grip,
            "closed": self._closed,
            # normal forces on the finger-tips [N]
            "touch": lambda: np.asarray(actor.body.contact_normals()[self._tips]),
            "phase": self._phase,
            # mechanical power of all joints, sum of |force x rate| [W]
            "power": lambda: np.array([self._power / max(self._steps, 1)]),
            # horizontal speed of the toes on the ground [m/s]
            "slip": lambda: np.array([self._slip / max(self._steps, 1)]),
            # height of the water at rest [m]
            "level": lambda: np.array([self._water], dtype=float),
            # numbers of the episode's draw
            "goal": lambda: self._goal,
            # joint positions of the target [rad or m]
            "turn": lambda: np.zeros(0) if thing is None else thing.body.joint_positions(),
        }
        for name in names:
            refuse_unlisted(name, kinds, f"no world knows '{name}'")
        self._actor, self._water = actor, environment.water_level
        self._body = options_of(actor.body, BodyOptions)
        self._kinds = {name: kinds[name] for name in names}
        robot = actor.robot
        self._hands = list(robot.grippers.values())
        self._tips = [t for hand in self._hands for t in hand.tips]
        self._feet = [leg.foot for leg in robot.legs.values()]
        self._toes = np.array([leg.toe for leg in robot.legs.values()])
        # refuse quantities of parts that the robot or the world lacks
        robot = self._actor.robot
        needs = {
            "grip": ("a gripper", bool(self._hands)),
            "closed": ("a gripper", bool(self._hands)),
            "touch": ("a gripper with tips", bool(self._tips)),
            "phase": ("legs", bool(self._feet)),
            "slip": ("legs", bool(self._feet)),
            "power": (
                "a backend whose bodies return joint forces, such as backend=pybullet",
                self._body.joint_forces() is not None,
            ),
            "level": ("water: environment.water_level", self._water is not None),
            "turn": ("a target with joints", thing is not None and thing.robot.tree.joints > 0),
        }
        for name in self._kinds:
            what, there = needs.get(name, ("", True))
            if not there:
                raise ConfigError(
                    f"the task asks for '{name}', which needs {what}; robot '{robot.name}' in this "
                    "world lacks it.\nAdd it, or choose another task."
                )
        self._power = self._slip = 0.0
        self._steps = 0
        self._rates: Floats | None = None
        self._goal = np.zeros(0)
        self.stepwise = bool({"power", "slip"} & set(self._kinds))

    def reset(self, goal: Floats) -> None:
        """Begin an episode with the numbers of its draw, shape (1, g)."""
        self._rates, self._goal = None, goal
        self.begin()

    def begin(self) -> None:
        """Begin a control step."""
        self._power = self._slip = 0.0
        self._steps = 0

    def observe(self) -> None:
        """Accumulate the quantities of one step of the world."""
        self._steps += 1
        if "power" in self._kinds:
            rates, forces = self._actor.body.read().joint_velocity, self._body.joint_forces()
            assert forces is not None
            # a force held over a step does its work at the mean rate
            before = rates if self._rates is None else self._rates
            self._power += 0.5 * float(np.abs(forces * (before + rates)).sum())
            self._rates = rates
        if "slip" in self._kinds:
            self._slip += self._sliding()

    def now(self) -> dict[str, Floats]:
        """Return all requested quantities, shape (1, k) each."""
        return {name: measure().reshape(1, -1) for name, measure in self._kinds.items()}

    def _grip(self) -> Floats:
        """Commanded grip, 0 for open and 1 for closed."""
        pilot = self._actor.pilot
        aim = None if pilot is None else pilot.aim
        wanted = {} if aim is None else aim.grip
        return np.array([wanted.get(hand.name, 0.0) for hand in self._hands])

    def _closed(self) -> Floats:
        """Measured grip: 0 for open and 1 for closed fingers."""
        joints = self._actor.body.joint_positions()
        shares = []
        for hand in self._hands:
            way = hand.closed - hand.open
            gone = joints[list(hand.joints)] - hand.open
            shares.append(float(gone @ way / (way @ way)))
        return np.array(shares)

    def _phase(self) -> Floats:
        """Cosines and sines of the phases of all legs."""
        pilot = self._actor.pilot
        assert pilot is not None
        memory = pilot.snapshot().controller or pilot.controller.start()
        angle = 2.0 * np.pi * np.reshape(memory.phase, -1)
        return np.concatenate((np.cos(angle), np.sin(angle)))

    def _sliding(self) -> float:
        """Mean horizontal speed of the toes that are on the ground now [m/s]."""
        stands = self._actor.body.contact_normals()[self._feet] > 0.0
        if not stands.any():
            return 0.0
        kinematics, moving = self._actor.look()
        turns = kinematics.rotations[0, self._feet]
        arms = np.einsum("nij,nj->ni", turns, self._toes)
        speed = moving.linear[0, self._feet] + np.cross(moving.angular[0, self._feet], arms)
        return float(np.hypot(speed[stands, 0], speed[stands, 1]).mean())
