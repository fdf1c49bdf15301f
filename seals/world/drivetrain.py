"""Drivetrain: command delay, then first-order lag of the actuators."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Array, Floats, as_like, namespace
from seals.effects.binding import EffectSet, bind_effects
from seals.effects.effect import ActuatorOptions, Parameters
from seals.errors import ConfigError
from seals.motion import Inputs, Timing
from seals.plugin_options import options_of
from seals.sensors.delivery import INSTANT

SHORT = 1e-9
"""Shortest time constant of a drive that does not follow at once [s]."""


class Delayed:
    """Pure delay of a held value.

    Args:
        delay: [s]; below zero it is zero.
        now: value before the first one arrives.

    Example:
        >>> line = Delayed(0.02, None)
        >>> line.give(0.0, np.ones((1, 1)))
        >>> line.take(0.01) is None, line.take(0.02)
        (True, array([[1.]]))
    """

    def __init__(self, delay: float, now: Floats | None) -> None:
        self.delay, self.now = max(delay, 0.0), now
        self._coming: tuple[tuple[float, Floats | None], ...] = ()

    def give(self, time: float, value: Floats | None) -> None:
        """Store the value commanded from ``time`` on [s]."""
        last = self._coming[-1][1] if self._coming else self.now
        if not _same(value, last):
            kept = None if value is None else np.array(value, dtype=float)
            self._coming = (*self._coming, (time + self.delay, kept))

    def arrivals(self, time: float) -> list[tuple[float, Floats | None]]:
        """Return the values that arrive up to ``time`` with their times [s]; store the last."""
        if not self._coming:
            return []
        due = [entry for entry in self._coming if entry[0] <= time + INSTANT]
        if due:
            self._coming, self.now = self._coming[len(due) :], due[-1][1]
        return due

    def take(self, time: float) -> Floats | None:
        """Return the delayed value at ``time`` [s]."""
        self.arrivals(time)
        return self.now

    def quiet(self, time: float) -> float:
        """Return for how long no value arrives after ``time`` [s]."""
        return self._coming[0][0] - INSTANT - time if self._coming else math.inf

    def snapshot(self) -> Any:
        """Return the pending values."""
        return self.now, self._coming

    def restore(self, kept: Any) -> None:
        """Restore a snapshot."""
        self.now, self._coming = kept


class CommandLaw(NamedTuple):
    """Change of the commands of one actuator by one effect.

    Args:
        columns: of the actuator among all drives.
        radius: of the actuator's discs [m], shape (n,).
        law: hook ``command`` of the effect.
        params: of the effect.
    """

    columns: slice
    radius: Array
    law: Callable[[Array, Array, Parameters], Array]
    params: Parameters


class Response(NamedTuple):
    """Lag, limits and delay of all drives of a robot.

    Args:
        lag: time constants, changes by effects included, zero for at once [s], shape (n,).
        limit: largest commands, rad/s or N, shape (n,).
        delay: between command and drive [s].
        fall: time constants while a drive slows down [s], shape (n,).
        power: power of the battery's voltage to which the limits are proportional [1], shape (n,).
        laws: changes of the commands within their limits, in the order in which they act.
    """

    lag: Array
    limit: Array
    delay: float
    fall: Array
    power: Array
    laws: tuple[CommandLaw, ...] = ()

    def over_batch(self, like: Array, effects: EffectSet) -> Response:
        """Return the response of a batch: arrays (1, n) in the library of ``like``.

        Args:
            like: an array of that library.
            effects: of the robots, with the values of each of them.

        Raises:
            ConfigError: commands arrive late: what is on the way has no form over a batch.
        """
        if self.delay > 0.0:
            raise ConfigError(
                f"commands arrive {self.delay:g} s late; a batch has no command delay.\n"
                "Leave the effect command_delay out, or use backend=pybullet."
            )
        lag, limit, _, fall, power = (as_like(np.atleast_2d(x), like) for x in self[:5])
        return Response(lag, limit, 0.0, fall, power, command_laws_of(effects, like))

    def limited(self, command: Array, share: Array | None) -> Array:
        """Return commands limited by the battery voltage; pure, on any array library.

        Args:
            command: in the unit of the drives, shape (B, n).
            share: voltage of the battery by its full voltage [1], shape (B, 1); None for full.
        """
        xp, most = namespace(command), self.limit
        if share is not None:
            left = xp.minimum(xp.maximum(share, share * 0.0), share * 0.0 + 1.0)
            most = most * left**self.power
        return xp.minimum(xp.maximum(command, -most), most)

    def goal(self, command: Array, share: Array | None) -> Array:
        """Return what the drives follow under commands: within the limits, as effects change them.

        Pure, on any array library; arguments as those of `limited`.
        """
        return commanded(self.limited(command, share), self.laws)

    def followed(self, state: Array, goal: Array, span: float) -> Array:
        """Return drive states after ``span`` [s] under held commands, shape (B, n); pure.

        Equation:
            x' = (u - x) / tau, solved exactly, with tau the fall where the drive slows down. A lag
            of zero keeps nothing, even over no time.
        """
        xp = namespace(state)
        rise, fall = _kept(self.lag, span), _kept(self.fall, span)
        return goal + (state - goal) * xp.where(xp.abs(goal) < xp.abs(state), fall, rise)


def commanded(command: Array, laws: Sequence[CommandLaw]) -> Array:
    """Return commands as effects change them, shape (B, n); pure, on any array library.

    Args:
        command: of all drives, in their units, shape (B, n).
        laws: of the effects, in the order in which they act.

    Example:
        >>> half = CommandLaw(slice(1, 2), np.zeros(1), lambda u, radius, params: 0.5 * u, {})
        >>> commanded(np.array([[4.0, 4.0]]), [half])
        array([[4., 2.]])
    """
    for columns, radius, law, params in laws:
        parts = [command[:, : columns.start], command[:, columns], command[:, columns.stop :]]
        parts[1] = law(parts[1], radius, params)
        command = namespace(command).concat(parts, axis=1)
    return command


def _kept(lag: Array, span: float) -> Array:
    """Share of the distance to its goal that a drive keeps over a span [s]."""
    xp = namespace(lag)
    kept = xp.exp(-span / xp.maximum(lag, lag * 0.0 + SHORT))
    return xp.where(lag > 0.0, kept, lag * 0.0)


class Drivetrain:
    """Drivetrain of a robot: command delay, drive lag, servo speed limits.

    A drive follows its command u by x' = (u(t - d) - x) / tau, solved exactly for commands that are
    held between changes, wherever in a step they arrive; tau is another one while the drive slows
    down. Effects with a hook ``command`` change u. Until the first command arrives a drive keeps
    its state. The place that a servo holds moves to its command with the servo's largest speed,
    and starts where the joint is.

    Args:
        effects: of the robot; its actuators give ``first``, ``count``, ``lag`` and ``limit``, its
            effects of timing change lag and delay.
        joints: number of joints.
    """

    def __init__(self, effects: EffectSet, joints: int) -> None:
        self.response = response_of(effects)
        self._lagging = bool(np.all(self.response.lag > 0.0) and np.all(self.response.fall > 0.0))
        # of the commands' own shape: broadcasting takes four times as long
        self._most, self._least = self.response.limit[None], -self.response.limit[None]
        speeds = speeds_of(effects, joints)
        self._speeds: list[float] | None = None if speeds is None else speeds[0].tolist()
        self._joints = joints
        self.reset()

    def reset(self) -> None:
        """Clear all commands."""
        delay = self.response.delay
        self._commands = Delayed(delay, None)
        self._torques = Delayed(delay, np.zeros((1, self._joints)))
        self._positions = Delayed(delay, None)
        self._time: float | None = None
        self._held: Floats | None = None
        self._share = 1.0
        self._asked: Any = None

    @property
    def held(self) -> Floats | None:
        """Commands that act now, shape (1, n); None before the first."""
        return self._commands.now

    @property
    def goal(self) -> Floats | None:
        """Joint positions that servos move to now [rad or m], shape (1, J); None for none."""
        return None if self._speeds is None else self._positions.now

    def quiet(self, time: float) -> float:
        """Return for how long no command arrives after ``time`` [s]."""
        return min(line.quiet(time) for line in (self._commands, self._torques, self._positions))

    def moved(self, held: Array, goal: Array, step: float) -> Array:
        """Return what `position` holds one step later, shape (1, J); pure, on any array library."""
        xp, most = namespace(held), step * np.array([self._speeds])
        return held + xp.minimum(xp.maximum(goal - held, as_like(-most, held)), as_like(most, held))

    def driven(self, command: Array, drive: Array, share: Array | None) -> list[Array]:
        """Return what the drives hold and are after a command that arrives at once; pure.

        Args:
            command: in the unit of the drives, shape (1, n).
            drive: states before, shape (1, n).
            share: voltage of the battery by its full voltage [1], shape (1, 1); None without one.
        """
        r, xp = self.response, namespace(command)
        held = xp.minimum(xp.maximum(command, self._least), self._most)
        if self._lagging:
            return [held, drive]
        same = share is None and not r.laws
        return [held, r.followed(drive, held if same else r.goal(held, share), 0.0)]

    def obeyed(self, command: Floats, held: Floats) -> None:
        """Note commands that were given without calls; shape (1, n) each.

        Args:
            command: the last one.
            held: what it became within the limits.
        """
        self._asked, self._commands.now = command.tolist(), held

    def aimed(self, goal: Floats) -> None:
        """Note targets of the joints that were given without calls, shape (1, J)."""
        self._positions.now = goal

    @property
    def late(self) -> bool:
        """Whether commands arrive late."""
        return self.response.delay > 0.0

    def passed(self, time: float, held: Floats | None) -> None:
        """Note steps that were made without calls; arguments of the last one.

        Args:
            time: at its start [s].
            held: what `position` would have returned.
        """
        self._time = time
        if self._speeds is not None and held is not None:
            self._held = held

    def drive(
        self,
        time: float,
        command: Floats | None,
        drive: Floats | None,
        share: float = 1.0,
        ahead: Floats | None = None,
    ) -> Floats | None:
        """Return the states of all drives at ``time``, shape (1, n).

        Args:
            time: [s]; later than that of the last call.
            command: held from now on, in the unit of the drives, shape (1, n); None for no new one.
            drive: states at the last call; None for standstill.
            share: voltage of the battery by its full voltage, which limits the drives [1].
            ahead: from `Response.followed` for all the time since the last call; None if not known.

        Raises:
            ConfigError: the command does not have one number a drive.
        """
        if command is not None:
            asked = command.tolist()
            if asked != self._asked:
                # a command, or refuse it; ``asked``: the same as lists
                count = len(self.response.lag)
                if np.shape(command) != (1, count) or not math.isfinite(sum(asked[0])):
                    raise ConfigError(
                        f"a command of shape {np.shape(command)}, or not finite, for {count} "
                        f"drives.\nAllowed: finite numbers of shape (1, {count}), one per drive "
                        "of all actuators."
                    )
                held = np.maximum(command, self._least)
                self._commands.give(time, np.minimum(held, self._most))
                self._asked = asked
        self._share = share
        at = time if self._time is None else self._time
        now: Floats | None = self._commands.now
        self._time, due = time, self._commands.arrivals(time)
        if ahead is not None and not due:
            return ahead
        if ahead is not None and due[0][0] >= time - INSTANT:
            drive, at = ahead, time
        for instant, following in due:
            drive = self._follow(drive, now, instant - at)
            at, now = max(at, instant), following
        return self._follow(drive, now, time - at)

    def torque(self, time: float, torque: Floats) -> Floats:
        """Return the delayed joint torques at ``time``, shape (1, J)."""
        self._torques.give(time, torque)
        return self._torques.take(time)  # type: ignore[return-value]

    def position(
        self, time: float, command: Floats | None, joints: Floats, step: float
    ) -> Floats | None:
        """Return the joint positions that the servos hold at ``time``, shape (1, J) or None.

        Args:
            time: [s].
            command: joint positions asked from now on, shape (1, J); None for none.
            joints: positions of the joints [rad or m], shape (1, J).
            step: since the last call [s].
        """
        self._positions.give(time, command)
        wanted = self._positions.take(time)
        if self._speeds is None or wanted is None:
            return wanted
        held, goal = (joints if self._held is None else self._held).tolist(), wanted.tolist()
        if self._held is None or held != goal:
            # a few numbers: faster one by one than as arrays
            pairs = zip(held[0], goal[0], self._speeds, strict=True)
            self._held = np.array([[h + min(max(g - h, -v * step), v * step) for h, g, v in pairs]])
        return self._held

    def _follow(self, drive: Floats | None, held: Floats | None, span: float) -> Floats | None:
        """States after ``span`` [s] under one held command."""
        if held is None or (span <= 0.0 and drive is not None and self._lagging):
            return drive
        goal, r = held, self.response
        if self._share < 1.0 or r.laws:
            goal = r.goal(held, np.array([[self._share]]))
        state = 0.0 * held if drive is None else drive
        after: Floats = r.followed(state, goal, max(span, 0.0))
        return after

    def snapshot(self) -> Any:
        """Return all pending commands."""
        lines = (self._commands, self._torques, self._positions)
        return (self._time, self._held), tuple(line.snapshot() for line in lines)

    def restore(self, kept: Any) -> None:
        """Restore a snapshot."""
        (self._time, self._held), lines = kept
        self._asked = None
        for line, part in zip((self._commands, self._torques, self._positions), lines, strict=True):
            line.restore(part)


def response_of(effects: EffectSet) -> Response:
    """Return lags, limits and delay of the actuators under the effects of timing."""
    actuators: list[Any] = [b.effect for b in effects.actuators]
    count = max((a.first + a.count for a in actuators), default=0)
    lag, limit = np.zeros(count), np.full(count, np.inf)
    fall, power = np.zeros(count), np.ones(count)
    change = timing_of(effects)
    for a in actuators:
        columns = slice(a.first, a.first + a.count)
        lag[columns] = np.maximum(a.lag + change.lag - change.asymmetry, 0.0)
        own = options_of(a, ActuatorOptions)
        slow = a.lag if own.fall is None else own.fall
        fall[columns] = np.maximum(slow + change.lag + change.asymmetry, 0.0)
        limit[columns] = a.limit
        power[columns] = own.voltage_power
    late = max(float(change.command_delay), 0.0)
    return Response(lag, limit, late, fall, power, command_laws_of(effects, lag))


def command_laws_of(effects: EffectSet, like: Array) -> tuple[CommandLaw, ...]:
    """Return the changes of commands by effects, each on the actuators of its link.

    Args:
        effects: of the robot.
        like: array of their library.
    """
    laws = []
    ends = [b.hooks.first + b.hooks.count for b in effects.actuators]
    still = np.zeros((1, max(ends, default=0)))
    for b in effects.commands:
        for a in effects.actuators:
            if a.links == b.links:
                columns = slice(a.hooks.first, a.hooks.first + a.hooks.count)
                # the parameters of the set may be those of another library
                plain = bind_effects({a.name: a.effect}, a.effect.links).actuators[0].params
                radius = a.hooks.drives(Inputs(0.0, still, still), plain).radius
                laws.append(CommandLaw(columns, as_like(radius, like), b.hooks.command, b.params))
    return tuple(laws)


def speeds_of(effects: EffectSet, joints: int) -> Floats | None:
    """Return the largest speeds of the servos' commands, shape (1, J); None without limits."""
    limits = [b.hooks.speeds(joints) for b in effects.joint_drives if hasattr(b.effect, "speeds")]
    if not joints or not limits or np.all(np.array(limits) >= np.finfo(float).max):
        return None
    found: Floats = np.min(limits, axis=0)[None]
    return found


def timing_of(effects: EffectSet) -> Timing:
    """Return the sum of all changes of timing of one robot, as numbers [s]."""
    total = np.zeros(len(Timing._fields))
    for b in effects.timings:
        total += [float(np.reshape(x, -1)[0]) for x in b.hooks.timing(b.params)]
    return Timing(*total.tolist())


def _same(a: Floats | None, b: Floats | None) -> bool:
    if a is None or b is None:
        return a is b
    # lists of a few numbers compare ten times as fast as arrays
    return a is b or a.tolist() == b.tolist()
