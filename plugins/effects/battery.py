"""Battery: drained by the actuators, its voltage limits their thrust."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.effects.effect import Effect, Parameters
from seals.effects.identification import Identification
from seals.motion import Drives, Inputs, Medium, Motion
from seals.plugins.effects.battery_sag import sagged
from seals.schema import param


@dataclass(kw_only=True)
class Battery(Effect):
    """Battery with open-circuit voltage over charge, internal resistance and capacity.

    Equation:
        V = cells E(s) - R I with P = V I the power of all drives and of the electronics;
        s' = -I / capacity; E(s) = -1.031 exp(-35 s) + 3.685 + 0.2156 s - 0.1178 s^2 + 0.3201 s^3.
        The largest speed of rotors falls with V / V_full, V_full = cells E(1); thrust falls as in
        ``battery_sag`` with the same sensitivity. Memory: charge taken [A s] and current [A].

    Args:
        cells: in series [1].
        capacity: [A s]; 3600 A s are one ampere hour.
        resistance: R, of all cells, wires and plugs [ohm].
        charge: state of charge at the start [1].
        electronics: power beside the drives [W].
        sensitivity: loss of thrust for a loss of voltage at a held command [1]; zero for speed
            controllers that hold the speed, about 2 for those that hold the duty.
        links: the link of the drives it feeds, the root by default.

    Assumptions:
        Constant temperature; no recovery after load; drives take power alone, whatever the voltage.

    Valid range:
        Lithium-polymer cells between 2 and 100 % of charge, up to some 20 C.

    Limitations:
        No ageing, no cut-off: an empty battery stays at the voltage of no charge. Joint servos
        draw from the electronics' power. The voltage follows the current one step later.

    References:
        Chen and Rincon-Mora 2006, IEEE Transactions on Energy Conversion 21(2), open-circuit
        voltage of a lithium-polymer cell.

    Example:
        >>> battery = Battery(cells=4.0, capacity=18000.0)
        >>> round(battery.full_voltage, 2)
        16.41
    """

    cells: float = param(
        4.0, "1", bounds=(1.0, 50.0), tolerance=0.0, source="chosen: 14.8 V", fit=False
    )
    capacity: float = param(
        18000.0, "A s", bounds=(1.0, 1e8), tolerance=900.0, source="chosen: 5 A h"
    )
    resistance: float = param(
        0.02, "ohm", bounds=(0.0, 100.0), tolerance=0.005, source="chosen: 5 mohm per cell"
    )
    charge: float = param(1.0, "1", bounds=(0.0, 1.0), tolerance=0.02, source="chosen: full")
    electronics: float = param(5.0, "W", bounds=(0.0, 1e5), tolerance=1.0, source="chosen")
    sensitivity: float = param(
        0.0, "1", bounds=(-5.0, 5.0), tolerance=0.05, source="zero: the speed is held"
    )
    accounts_for: ClassVar[tuple[str, ...]] = ("battery sag",)
    memory_size: ClassVar[int] = 2
    # the drop at the first current comes a step late and hides the order of a method
    material: ClassVar[dict[str, float]] = {"charge": 0.3, "sensitivity": 2.0, "resistance": 1e-4}
    # its sag is a candidate by itself
    identification: ClassVar[Identification] = Identification(
        searched=False,
        compared=None,
    )

    @property
    def full_voltage(self) -> float:
        """Open-circuit voltage of the full battery [V]."""
        return self.cells * _FULL

    @staticmethod
    def state(memory: Array, params: Parameters) -> tuple[Array, Array, Array]:
        """Terminal voltage [V], current [A] and state of charge [1], shape (N, 1) each."""
        if _one(memory, params):
            left, voltage = _rest(memory, params)
            current = memory.item(1)
            voltage -= params["resistance"].item() * current
            return np.array([[voltage]]), np.array([[current]]), np.array([[left]])
        left, current = _left(memory, params), memory[:, 1:2]
        open_circuit = params["cells"] * cell_voltage(left)
        return open_circuit - params["resistance"] * current, current, left

    @staticmethod
    def battery_update(power: Array, inputs: Inputs, memory: Array, params: Parameters) -> Array:
        """Return the new battery state after a step under the power [W] of the drives, (N, 1)."""
        if _one(memory, params) and power.size == 1:
            return _drained(power.item(), float(inputs.step), memory, params)
        xp = namespace(memory)
        total = power + params["electronics"]
        open_circuit = params["cells"] * cell_voltage(_left(memory, params))
        # V I = P with V = E - R I; beyond the largest power the battery gives E / (2 R)
        root = open_circuit * open_circuit - 4.0 * params["resistance"] * total
        current = 2.0 * total / (open_circuit + xp.sqrt(xp.maximum(root, root * 0.0)))
        current = xp.minimum(current, open_circuit / (2.0 * params["resistance"] + 1e-9))
        return xp.concat((memory[:, 0:1] + current * inputs.step, current), axis=1)

    @staticmethod
    def actuation(
        drives: Drives, motion: Motion, medium: Medium, inputs: Inputs, params: Parameters
    ) -> Drives:
        """Thrusts [N] and reaction torques [N m] at the voltage."""
        if inputs.voltage is None:
            return drives
        full = params["cells"] * _FULL
        return sagged(drives, inputs.voltage / full, params["sensitivity"])


def cell_voltage(left: Array) -> Array:
    """Return the open-circuit voltage of a lithium-polymer cell at a state of charge [V].

    Example:
        >>> import numpy as np
        >>> cell_voltage(np.array([0.0, 0.5, 1.0])).round(3)
        array([2.654, 3.803, 4.103])
    """
    xp = namespace(left)
    slope = 0.2156 - 0.1178 * left + 0.3201 * left * left
    return 3.685 + slope * left - 1.031 * xp.exp(-35.0 * left)


_FULL = 3.685 + 0.2156 - 0.1178 + 0.3201


def _left(memory: Array, params: Parameters) -> Array:
    """State of charge [1], shape (N, 1)."""
    left = params["charge"] - memory[:, 0:1] / params["capacity"]
    return namespace(left).maximum(left, left * 0.0)


_NUMBERS = ("cells", "capacity", "resistance", "charge", "electronics")


def _one(memory: Array, params: Parameters) -> bool:
    """Return whether there is one battery only, which is computed with plain numbers for speed."""
    if type(memory) is not np.ndarray or len(memory) != 1:
        return False
    return all(params[key].size == 1 for key in _NUMBERS)


def _rest(memory: Floats, params: Parameters) -> tuple[float, float]:
    """State of charge [1] and open-circuit voltage [V] of one battery."""
    s = max(params["charge"].item() - memory.item(0) / params["capacity"].item(), 0.0)
    slope = 0.2156 - 0.1178 * s + 0.3201 * s * s
    return s, params["cells"].item() * (3.685 + slope * s - 1.031 * math.exp(-35.0 * s))


def _drained(power: float, step: float, memory: Floats, params: Parameters) -> Floats:
    """`Battery.battery_update` of one battery."""
    resistance = params["resistance"].item()
    total, voltage = power + params["electronics"].item(), _rest(memory, params)[1]
    root = math.sqrt(max(voltage * voltage - 4.0 * resistance * total, 0.0))
    current = min(2.0 * total / (voltage + root), voltage / (2.0 * resistance + 1e-9))
    return np.array([[memory.item(0) + current * step, current]])
