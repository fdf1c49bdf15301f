"""The nominal arm: random sizes, its description, its model file and its numbers for the plant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.validation.hidden import vehicles
from tests.validation.hidden.arm import JOINTS, centre_of_all, pose, turned
from tests.validation.hidden.plant import Deviations, Plant
from tests.validation.hidden.rotation import Array
from tests.validation.hidden.vehicles import Vehicle, six

STOWED = np.array([1.35, -2.35, 0.9])
ROD = 0.0173  # radius of gyration's source: links as rods of this radius [m]


@dataclass
class Arm:
    """Three links in a row; arrays run over the links."""

    masses: Array
    lengths: Array
    gripper: float
    origin: Array
    stiff: float
    damp: float
    base_mass: float
    base_inertia: Array
    base_centre: Array
    limit: float = 2.5
    armature: float = 0.002
    joints: int = JOINTS

    def shapes(self, share: Array) -> tuple[Array, Array, Array]:
        """Masses, centres below the joint and inertias (3, links) with scaled masses (4,)."""
        rods = self.masses - np.array([0.0, 0.0, self.gripper])
        rods, grip = rods * share[:JOINTS], self.gripper * share[JOINTS]
        tip = np.array([0.0, 0.0, grip])
        mass = rods + tip
        centre = (0.5 * rods + tip) * self.lengths / mass
        off = rods * (centre - 0.5 * self.lengths) ** 2 + tip * (self.lengths - centre) ** 2
        across = rods * self.lengths**2 / 12.0 + off
        along = 0.5 * mass * ROD**2
        return mass, centre, np.stack((across, across, along))

    def parameters(self, share: Array) -> Plant:
        """The arm's part of a plant."""
        mass, centre, inertia = self.shapes(share)
        origin = np.zeros((3, JOINTS))
        origin[:, 0] = self.origin
        return {
            "link_mass": mass,
            "link_centre": centre,
            "link_inertia": inertia,
            "link_length": self.lengths,
            "joint_origin": origin,
        }

    def centre(self, angle: Array) -> Array:
        """Nominal centre of gravity of the vehicle (3, n) at joint angles (3, n)."""
        return centre_of_all(self, angle)

    def as_plant(self, n: int) -> Plant:
        """Nominal numbers of n like cases, enough for forward kinematics."""
        out = self.parameters(np.ones(JOINTS + 1)) | {"payload_place": np.zeros(3)}
        return {k: np.repeat(v[..., None], n, axis=-1) for k, v in out.items()}

    def truth(self, plant: Plant, off: Deviations, rng: np.random.Generator) -> None:
        """True parameters of base and arm about the nominal ones."""
        share = 1.0 + off("link_mass", JOINTS + 1)
        plant.update(self.parameters(share))
        plant["mass"] = self.base_mass * (1.0 + off("mass"))
        plant["com"] = self.base_centre + off("centre_of_gravity", 3)
        plant["inertia"] = self.base_inertia * (1.0 + off("inertia", 3))
        plant["servo_stiff"] = self.stiff * (1.0 + off("joint_kp"))
        plant["servo_damp"] = self.damp * (1.0 + off("joint_kd"))
        plant["rub"] = np.abs(off("joint_friction", JOINTS))
        plant["rub_viscous"] = 0.3 * plant["rub"]
        plant["hidden_rub"] = plant["hidden_viscous"] = plant["backlash"] = np.zeros(JOINTS)
        plant["stribeck"] = np.array(rng.uniform(0.0, 0.15))
        plant["servo_limit"], plant["armature"] = np.array(self.limit), np.array(self.armature)
        plant["joint_start"] = np.zeros(JOINTS)

    def describe(self) -> dict[str, Any]:
        """The arm as the description states it."""
        mass, centre, inertia = self.shapes(np.ones(JOINTS + 1))
        links = []
        for i in range(JOINTS):
            above = self.origin if i == 0 else np.array([0.0, 0.0, -self.lengths[i - 1]])
            links.append(
                {
                    "name": f"link{i + 1}",
                    "mass": six(mass[i]),
                    "centre_of_gravity": [0.0, 0.0, -six(centre[i])],
                    "inertia": np.diag(six(inertia[:, i])),
                    "length": six(self.lengths[i]),
                    "joint": {
                        "name": f"joint{i + 1}",
                        "type": "revolute",
                        "axis": [0, 1, 0],
                        "origin": six(above),
                        "lower": -2.8,
                        "upper": 2.8,
                    },
                }
            )
        law = "torque = kp (cmd - angle) - kd rate, angle and rate on the motor side"
        return {
            "links": links,
            "zero_pose": "all links along body -z",
            "stowed": STOWED,
            "gripper_mass": self.gripper,
            "gripper_note": "a point at the tip of link3, already inside link3",
            "controller": {
                "law": law,
                "kp": self.stiff,
                "kd": self.damp,
                "torque_limit": self.limit,
                "armature": self.armature,
                "encoder": "link side",
            },
        }

    def base_entry(self) -> dict[str, Any]:
        """The vehicle without its arm."""
        return {
            "base": {
                "mass": self.base_mass,
                "centre_of_gravity": self.base_centre,
                "inertia": np.diag(self.base_inertia),
                "note": "vehicle without the arm; inertia about its own centre of gravity",
            },
            "inertia_note": "inertia of the whole vehicle is for control only; "
            "with an arm use base and arm.links",
        }

    def urdf(self, vehicle: Vehicle) -> str:
        """Model file of base, links and joints."""
        lines = ['<?xml version="1.0"?>', f'<robot name="{vehicle.kind}">']
        lines.append(_link("base", self.base_centre, self.base_mass, self.base_inertia))
        before = "base"
        for part in self.describe()["links"]:
            name, joint = part["name"], part["joint"]
            place = np.asarray(part["centre_of_gravity"])
            lines.append(_link(name, place, part["mass"], np.diag(part["inertia"])))
            origin = " ".join(f"{x:g}" for x in joint["origin"])
            lines.append(
                f'  <joint name="{joint["name"]}" type="revolute"><parent link="{before}"/>'
                f'<child link="{name}"/><origin xyz="{origin}" rpy="0 0 0"/>'
                f'<axis xyz="0 1 0"/><limit lower="-2.8" upper="2.8" effort="2.5" velocity="10"/>'
                "</joint>"
            )
            before = name
        return "\n".join([*lines, "</robot>", ""])


def _link(name: str, place: Array, mass: float, inertia: Array) -> str:
    xyz = " ".join(f"{x:g}" for x in place)
    xx, yy, zz = (f"{x:g}" for x in inertia)
    return (
        f'  <link name="{name}">\n    <inertial><origin xyz="{xyz}" rpy="0 0 0"/>'
        f'<mass value="{mass:g}"/><inertia ixx="{xx}" ixy="0" ixz="0" iyy="{yy}" iyz="0" '
        f'izz="{zz}"/></inertial>\n  </link>'
    )


def _random_arm(rng: np.random.Generator) -> Arm:
    masses = rng.uniform([0.105, 0.088, 0.105], [0.135, 0.12, 0.135])
    return Arm(
        masses=six(masses),
        lengths=six(rng.uniform([0.13, 0.115, 0.06], [0.17, 0.137, 0.08])),
        gripper=six(masses[2] * rng.uniform(0.53, 0.6)),
        origin=six([rng.uniform(0.008, 0.025), 0.0, -rng.uniform(0.053, 0.07)]),
        stiff=six(rng.uniform(6.0, 9.7)),
        damp=six(rng.uniform(0.21, 0.3)),
        base_mass=six(rng.uniform(2.05, 2.8)),
        base_inertia=np.zeros(3),
        base_centre=np.zeros(3),
    )


def aam(rng: np.random.Generator) -> Vehicle:
    """A quadrotor with a three-joint arm; balanced when the arm is stowed."""
    arm = _random_arm(rng)
    mass, reach = six(arm.base_mass + arm.masses.sum()), rng.uniform(0.17, 0.21)
    xx = arm.base_mass * reach**2 * rng.uniform(0.32, 0.44)
    yy = xx * rng.uniform(1.0, 1.15)
    arm.base_inertia = six([xx, yy, (xx + yy) * rng.uniform(0.82, 0.94)])
    stowed = STOWED[:, None]
    # the base's centre is set so that base and stowed arm balance about the origin
    arm.base_centre = six(-centre_of_all(arm, stowed)[:, 0] * mass / arm.base_mass)
    whole = arm.base_inertia + arm.base_mass * _off_axis(arm.base_centre)
    where = pose(arm.as_plant(1), stowed)
    own = arm.shapes(np.ones(JOINTS + 1))[2]
    for i in range(JOINTS):
        place = where.centres[i][:, 0]
        spun = turned(own[:, i : i + 1], where.angles[i])[..., 0]
        whole = whole + np.diag(spun) + arm.masses[i] * _off_axis(place)
    return Vehicle(
        kind="aam",
        mass=mass,
        inertia=six(whole),
        angular_linear=six([rng.uniform(0.002, 0.005)] * 3) if rng.random() < 0.5 else np.zeros(3),
        ground=0.0,
        gust_force=six(0.02 * mass),
        gust_torque=six(0.0004 * mass),
        arm=arm,
        **vehicles.rotors(rng, mass, reach, rng.uniform(0.0, 0.038)),
        **vehicles.air(rng),
    )


def wading(rng: np.random.Generator) -> Vehicle:
    """An aerial manipulator whose base is a hull that dips into water."""
    vehicle = aam(rng)
    size = six(rng.uniform([0.2, 0.17, 0.095], [0.23, 0.2, 0.11]))
    drag = rng.uniform(7.0, 10.0)
    vehicle.primitives = [
        {"type": "box", "position": [0, 0, 0], "rpy": [0, 0, 0], "size": list(size)}
    ]
    vehicle.volume = six(vehicle.mass / vehicles.WATER * rng.uniform(0.45, 0.6))
    vehicle.centre_of_buoyancy = six([0.0, 0.0, rng.uniform(0.005, 0.015)])
    vehicle.plan_area = six(size[0] * size[1])
    vehicle.water_quadratic = six([drag, drag * rng.uniform(1.0, 1.3), rng.uniform(14.0, 20.0)])
    vehicle.angular_linear = six([rng.uniform(0.05, 0.07)] * 3)
    vehicle.water, vehicle.ground, vehicle.bottom = True, None, -3.0
    return vehicle


def _off_axis(place: Array) -> Array:
    x, y, z = place
    return np.array([y * y + z * z, x * x + z * z, x * x + y * y])
