"""Inputs of effects: motion of the links, medium around them, commands.

Every quantity is batch first, shape (N, k): N links of a scene, bodies of a batch, or samples of a
log. Vectors are in link axes (x forward, y left, z up) about the link origin unless the name says
world.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from seals.arrays import Array, namespace


class MediumKind(Enum):
    """The medium in which an effect acts.

    Example:
        >>> [kind.name for kind in MediumKind]
        ['water', 'air', 'any']
    """

    water = "water"
    air = "air"
    any = "any"


class Body(NamedTuple):
    """Constant properties of the links.

    Args:
        mass: [kg], shape (N, 1).
        centre_of_mass: in link axes [m], shape (N, 3).
        volume: displaced volume when fully submerged [m^3], shape (N, 1).
        plan_area: area of the hull projected along link z [m^2], shape (N, 1).
        entry_shares: submerged shares of `seals.hydrostatics.entry.entry_shares` [1], shape (N, 6);
            None for those of an ellipsoid.
    """

    mass: Array
    centre_of_mass: Array
    volume: Array
    plan_area: Array
    entry_shares: Array | None = None


class Motion(NamedTuple):
    """Pose and twist of the links.

    Args:
        time: [s], shape (1, 1) or (N, 1).
        position: p_WL, link origin in the world [m], shape (N, 3).
        rotation: R_WL, shape (N, 3, 3).
        up: world z axis in link axes [1], shape (N, 3).
        velocity: of the link origin over ground, link axes [m/s], shape (N, 3).
        angular_velocity: link axes [rad/s], shape (N, 3).
        body: constant properties of the links.

    Example:
        >>> import numpy as np
        >>> still, turn = np.zeros((1, 3)), np.eye(3)[None]
        >>> up = np.array([[0.0, 0.0, 1.0]])
        >>> Motion(np.zeros((1, 1)), still, turn, up, still, still, None).position.shape
        (1, 3)
    """

    time: Array
    position: Array
    rotation: Array
    up: Array
    velocity: Array
    angular_velocity: Array
    body: Body


class Medium(NamedTuple):
    """Medium around the links, for an effect of one medium.

    ``medium_fraction``, ``velocity``, ``density`` and ``viscosity`` are those of the effect's own
    medium; the rest is the same for all effects.

    Args:
        medium_fraction: weight of the effect's medium, s in water, 1 - s in air, 1 for any [1],
            shape (N, 1).
        velocity: of the effect's medium over ground, link axes [m/s], shape (N, 3).
        acceleration: of the effect's medium over ground, link axes [m/s^2], shape (N, 3).
        density: of the effect's medium [kg/m^3], shape (N, 1).
        viscosity: dynamic viscosity of the effect's medium [Pa s], shape (N, 1).
        submersion: s, submerged share of the displaced volume [1], shape (N, 1).
        submersion_rate: ds/dt [1/s], shape (N, 1).
        buoyancy_centre: centroid of the submerged volume, link axes [m], shape (N, 3).
        normal: outward normal of the water surface, link axes [1], shape (N, 3).
        sinking_speed: speed of the link origin against the water normal [m/s], shape (N, 1).
        gravity: [m/s^2], shape (1, 1).
        depth: of the link origin below the water surface [m], shape (N, 1); None without water.
        water_density: at the link [kg/m^3], shape (1 or N, 1); None when not known.
        air_density: [kg/m^3], shape (1, 1); None when not known.

    Example:
        >>> Medium._fields[:3]
        ('medium_fraction', 'velocity', 'acceleration')
    """

    medium_fraction: Array
    velocity: Array
    acceleration: Array
    density: Array
    viscosity: Array
    submersion: Array
    submersion_rate: Array
    buoyancy_centre: Array
    normal: Array
    sinking_speed: Array
    gravity: Array
    depth: Array | None = None
    water_density: Array | None = None
    air_density: Array | None = None


class Joints(NamedTuple):
    """Joint coordinates, shape (N, J): position [m or rad], velocity [m/s or rad/s].

    Example:
        >>> import numpy as np
        >>> Joints(position=np.zeros((1, 2)), velocity=np.ones((1, 2))).velocity
        array([[1., 1.]])
    """

    position: Array
    velocity: Array


def by_joint(values: Array, joints: Joints) -> Array:
    """Reshape one number per row, rows joint by joint, to one number per joint.

    Args:
        values: of the links that the joints move, shape (J N, 1); (1, 1) for all.
        joints: of N bodies.

    Returns:
        Values of shape (N, J), or (1, 1).

    Example:
        >>> import numpy as np
        >>> still = np.zeros((2, 3))
        >>> by_joint(np.arange(6.0)[:, None], Joints(still, still))
        array([[0., 2., 4.],
               [1., 3., 5.]])
    """
    bodies, count = joints.velocity.shape
    if values.shape[0] == 1:
        return values
    xp = namespace(values)
    return xp.permute_dims(xp.reshape(values, (count, bodies)), (1, 0))


class Inputs(NamedTuple):
    """Inputs to the physics: commands, drive states and battery voltage.

    Args:
        step: time since the memory was last updated [s].
        joint_torque: commanded generalised force of the joints [N m or N], shape (1 or B, J).
        drive: state of every actuator after its lag, in the order of the actuators: rotor speed
            [rad/s] or thruster force [N], shape (1 or B, n); None when there is none.
        voltage: terminal voltage of the battery [V], shape (1 or B, 1); None when not known.
        joint_command: commanded joint positions [rad or m], shape (1 or B, J); None for none.
        joint_rate: commanded joint velocities [rad/s or m/s], shape (1 or B, J); None for zero.

    Example:
        >>> import numpy as np
        >>> rotors = np.full((1, 4), 350.0)
        >>> Inputs(step=0.004, joint_torque=np.zeros((1, 0)), drive=rotors).drive.shape
        (1, 4)
    """

    step: float
    joint_torque: Array
    drive: Array | None = None
    voltage: Array | None = None
    joint_command: Array | None = None
    joint_rate: Array | None = None


class JointDrive(NamedTuple):
    """Unlimited force of joint drives, and its stiffness and damping.

    Args:
        force: generalised force without the limit [N m or N], shape (N, J).
        stiffness: fall of the force with the joint's position [N m/rad or N/m], (1 or N, J).
        damping: fall of the force with the joint's velocity [N m s/rad or N s/m], likewise.
        limit: largest force [N m or N], likewise.
    """

    force: Array
    stiffness: Array
    damping: Array
    limit: Array


class Drives(NamedTuple):
    """Thrusts and torques of the n actuators on one link, about its origin, link axes.

    Args:
        position: of the hubs [m], shape (n, 3).
        axis: direction of positive thrust, unit vectors [1], shape (n, 3).
        radius: of the rotor discs, zero if there is none [m], shape (n,).
        thrust: along the axes [N], shape (N, n).
        torque: reaction of the drive about the axes [N m], shape (N, n).
        speed: of rotors, as the medium and the motor leave it [rad/s], shape (N, n); None for
            drives that know their force alone.
    """

    position: Array
    axis: Array
    radius: Array
    thrust: Array
    torque: Array
    speed: Array | None = None


class Timing(NamedTuple):
    """Changes of command and sensor delays and of time constants, shape (1 or N, 1) or numbers.

    Args:
        command_delay: further delay between command and actuator [s].
        lag: change of the actuators' first-order time constant [s].
        sensor_delay: further delay of gyroscope and accelerometer [s].
        asymmetry: by which that time constant is longer while a drive slows down, and shorter while
            it speeds up [s].
    """

    command_delay: Array | float = 0.0
    lag: Array | float = 0.0
    sensor_delay: Array | float = 0.0
    asymmetry: Array | float = 0.0


class Reading(NamedTuple):
    """Reading of an inertial sensor, sensor axes, shape (N, 3).

    Args:
        angular_velocity: [rad/s].
        specific_force: [m/s^2].
        angular_acceleration: true one at the instant of the specific force [rad/s^2]; None where
            the sensor cannot turn.
        turning: true angular velocity at that instant [rad/s]; None likewise.
    """

    angular_velocity: Array
    specific_force: Array
    angular_acceleration: Array | None = None
    turning: Array | None = None


class Wrench(NamedTuple):
    """A wrench about the link origin in link axes; None stands for zero.

    Args:
        force: [N], shape (N, 3).
        torque: [N m], shape (N, 3).

    Example:
        >>> import numpy as np
        >>> Wrench(force=np.array([[0.0, 0.0, 9.81]]), torque=None).force.shape
        (1, 3)
    """

    force: Array | None
    torque: Array | None


class AddedInertia(NamedTuple):
    """Inertia added to a link, ``weight`` times ``matrix``, about the link origin, link axes.

    Args:
        matrix: 6x6, order [linear, angular] [kg, kg m, kg m^2], shape (1 or N, 6, 6).
        weight: [1], shape (N, 1).
        more: further inertia that changes with the state, likewise, shape (N, 6, 6), along
            directions that rest in the world while the link turns: it has no Coriolis and Munk
            terms; None for none.
        apart: whether it is that of ``more``, which engines leave out of their masses.
    """

    matrix: Array
    weight: Array
    more: Array | None = None
    apart: bool = False
