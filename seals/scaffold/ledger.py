"""Ledger of an import: every entry of a robot's file is used, or left out with the reason.

An entry is an attribute or a text, by the element that holds it and the one above, such as
``inertial/mass@value`` or ``inertia/ixx#``. What the tables do not name is left out as unknown.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from fnmatch import fnmatchcase
from xml.etree import ElementTree

Element = ElementTree.Element

UNKNOWN = "not part of the format as read by SEALS"
KEY = "of plug-ins: not used by any law of SEALS"
_WORDS = "names of shapes, materials and files without references"
_DRAWN = "appearance: shapes are rendered in one colour"
_CONTACT = "contact: all robots have the same stiffness and friction (docs/limits.md)"
_PROGRAM = "settings of another program: solver, topics, cameras, scenes"
_SENSORS = "sensors: those of SEALS are listed under sensors: in robot.yaml"
_FRICTION = "friction, damping and springs of joints: seals describe effect joint_friction"
_MIMIC = "a joint that follows another: here it moves independently, with its own servo"
_SAFETY = "limits of another controller"
_PLACE = "place in the world: initial.position; joints to the world keep their position"
_COMMANDS = "command ranges of servos: limited by the joint limits"
_TELLING = "numbers of wings and thrusters that no law uses: listed by the import"
_SPEED = "speed limits of joints: speed_limit of servos, maximum speed of propellers"
_MOTION = "transmissions: they state which joints are driven, but no numbers"

_HYDRO = r"[xyzkmn](Dot|[aA]bs)?[UVWPQR]([aA]bs)?[UVWPQR]?"
_PLUGIN_KEYS = frozenset(
    re.findall(
        r"\w+",
        # motors and thrusters
        "motorConstant forceConstant momentConstant maxRotVelocity timeConstantUp timeConstantDown "
        "rotorDragCoefficient turningDirection direction motorType linkName jointName link_name "
        "joint_name propeller_diameter max_thrust_cmd min_thrust_cmd conversion "
        "rotorConstant rotorConstantL rotorConstantR deltaL deltaR inputValues outputValues "
        "clampMax clampMin thrustMax thrustMin dynamics timeConstant maxForceFwd maxForceRev "
        "propJointName multiplier offset cmd_topic "
        # hulls
        "hydrodynamic_model added_mass linear_damping quadratic_damping "
        "linear_damping_forward_speed volume neutrally_buoyant center_of_buoyancy "
        "center_of_volume fluid_density bodyName "
        # wings, and links that are held
        "cla area cp forward upward air_density liftdrag "
        "lift_constant drag_constant parent_link child_link child_model type",
    )
)

_TOLD = frozenset(
    ("a0", "cda", "cma", "alpha_stall", "control_joint_name", "thrust_coefficient", "thrusterID")
)

_USED = {
    "robot": (
        "robot@name robot/link@name robot/joint@name robot/joint@type inertial/origin@* "
        "inertial/mass@value inertial/inertia@i?? collision/origin@* visual/origin@* "
        "geometry/*@size geometry/*@radius geometry/*@length geometry/mesh@filename "
        "geometry/mesh@scale joint/parent@link joint/child@link joint/origin@* joint/axis@xyz "
        "joint/limit@lower joint/limit@upper joint/limit@effort robot/gazebo@reference"
    ),
    "sdf": (
        "*/model@name model/link@name model/joint@name model/joint@type model/frame@name "
        "*/pose# */pose@relative_to */pose@frame */pose@degrees */pose@rotation_format "
        "model/frame@attached_to inertial/mass# inertia/ixx# inertia/ixy# inertia/ixz# "
        "inertia/iyy# inertia/iyz# inertia/izz# fluid_added_mass/*# box/size# cylinder/radius# "
        "cylinder/length# capsule/radius# capsule/length# sphere/radius# ellipsoid/radii# "
        "mesh/uri# mesh/scale# joint/parent# joint/child# parent/link# child/link# axis/xyz# "
        "model/static# axis/xyz@expressed_in axis/use_parent_model_frame# limit/lower# "
        "limit/upper# "
        "limit/effort# include/uri# include/name#"
    ),
    "mujoco": (
        "mujoco@model compiler@angle compiler@meshdir compiler@assetdir compiler@autolimits "
        "compiler@eulerseq compiler@inertiafromgeom compiler@inertiagrouprange "
        "compiler@boundmass compiler@boundinertia compiler@balanceinertia compiler@settotalmass "
        "compiler@coordinate compiler@fusestatic compiler@discardvisual "
        "default@class body@childclass */*@class include@file frame@* "
        "body@name body/body@* frame/body@* "
        "freejoint@name joint@name joint@type joint@axis joint@pos joint@range joint@limited "
        "joint@ref joint@damping joint@armature inertial@* geom@type geom@size "
        "geom@pos geom@quat geom@euler geom@axisangle geom@xyaxes geom@zaxis geom@fromto "
        "geom@mass geom@density geom@mesh "
        "geom@contype geom@conaffinity geom@shellinertia geom@name mesh@name mesh@file "
        "mesh@scale mesh@vertex mesh@face mesh@refpos mesh@refquat mesh@inertia "
        "site@name site@pos site@quat site@euler site@axisangle site@xyaxes site@zaxis "
        "site@fromto motor@* position@name position@joint position@k[pv] "
        "position@forcerange position@forcelimited position@gear velocity@* general@* "
        "damper@* key@name key@qpos"
    ),
}
"""Entries that are used, by the root of the dialect; of MJCF by the element that holds them."""

_LEFT = {
    "robot": {
        "collision@name visual@name robot/material@name robot@version "
        "robot@*schemaLocation": _WORDS,
        "joint/mimic@*": _MIMIC,
        "joint/dynamics@*": _FRICTION,
        "joint/limit@velocity": _SPEED,
        "joint/safety_controller@* joint/calibration@*": _SAFETY,
        "joint/axis@*": "only the direction of an axis is used",
    },
    "sdf": {
        "sdf@version collision@name visual@name": _WORDS,
        "limit/velocity#": _SPEED,
        "dynamics/*#": _FRICTION,
        "limit/stiffness# limit/dissipation#": _CONTACT,
        "top/pose*": _PLACE,
        "plane/*#": "planes have no volume",
        "link/self_collide# model/self_collide# link/enable_wind# model/enable_wind# "
        "link/gravity# link/kinematic# model/allow_auto_disable# link/must_be_base_link# "
        "include/static# include@merge joint/namespace#": _PROGRAM,
        "inertia/iyx# inertia/izx# inertia/izy#": "entries below the diagonal: it is symmetric",
        "model@canonical_link model@placement_frame include@placement_frame": _PROGRAM,
    },
    "mujoco": {
        "joint@stiffness joint@springref joint@springdamper joint@frictionloss": _FRICTION,
        "joint@actuatorfrc* joint@group joint@user joint@margin joint@actuatorgravcomp": _SAFETY,
        "joint@sol* geom@friction geom@sol* geom@margin geom@gap geom@priority geom@cond* "
        "geom@fluid*": _CONTACT,
        "geom@rgba geom@material geom@group site@rgba site@group site@size site@type "
        "site@material mesh@class material@* texture@* mesh@smoothnormal mesh@maxhullvert": _DRAWN,
        "compiler@*": _PROGRAM,
        "position@*": _COMMANDS,
        "worldbody/body@*": _PLACE,
        "body@mocap body@gravcomp body@user body@sleep geom@user geom@hfield geom@fitscale "
        "": _PROGRAM,
        "freejoint@align freejoint@group key@*": _PROGRAM,
        "mesh@*": _PROGRAM,
    },
}
_BRANCHES = {
    "robot": {
        "robot/material visual/material": _DRAWN,
        "robot/transmission robot/ros2_control": _MOTION,
        "link/sensor robot/sensor gazebo/sensor": _SENSORS,
        "gazebo/material gazebo/visual gazebo/laserRetro": _DRAWN,
        "gazebo/collision gazebo/mu* gazebo/fdir* gazebo/kp gazebo/kd gazebo/minDepth "
        "gazebo/maxVel gazebo/maxContacts gazebo/bounce* gazebo/selfCollide gazebo/self_collide "
        "link/contact": _CONTACT,
        "gazebo/dampingFactor gazebo/springStiffness gazebo/springReference "
        "gazebo/implicitSpringDamper gazebo/stop* gazebo/fudgeFactor gazebo/cfmDamping": _FRICTION,
        "gazebo/turnGravityOff gazebo/gravity gazebo/static gazebo/enable_wind gazebo/battery "
        "gazebo/provideFeedback gazebo/preserveFixedJoint gazebo/disableFixedJointLumping "
        "gazebo/kinematic gazebo/pose gazebo/velocity_decay gazebo/camera gazebo/light "
        "robot/group robot/group_state robot/disable_collisions robot/properties robot/frame "
        "robot/static_map": _PROGRAM,
        "gazebo/neutrally_buoyant": KEY,
        "robot/loop_joint robot/*:bushing": "constraints between bodies: all joints move freely",
    },
    "sdf": {
        "visual/material visual/transparency visual/cast_shadows visual/meta visual/laser_retro "
        "visual/visibility_flags": _DRAWN,
        "collision/surface collision/max_contacts collision/laser_retro": _CONTACT,
        "link/sensor joint/sensor": _SENSORS,
        "link/light world/light world/scene world/physics world/gui "
        "world/gravity world/magnetic_field "
        "world/atmosphere world/wind world/spherical_coordinates world/audio world/road "
        "world/state world/population world/actor world/plugin world/frame link/velocity_decay "
        "link/particle_emitter link/battery link/audio_source joint/physics model/gripper "
        "": _PROGRAM,
        "mesh/submesh": "parts of a mesh: the whole file is used",
    },
    "mujoco": {
        "mujoco/sensor": _SENSORS,
        "mujoco/visual mujoco/option mujoco/size mujoco/statistic mujoco/custom body/camera "
        "worldbody/camera body/light worldbody/light": _PROGRAM,
        "mujoco/contact": _CONTACT,
        "mujoco/equality mujoco/tendon": "constraints between bodies, and tendons: all joints "
        "move freely",
        "asset/material asset/texture asset/hfield default/material default/texture": _DRAWN,
        "body/plugin mujoco/extension mujoco/deformable": KEY,
        "actuator/intvelocity actuator/adhesion actuator/muscle actuator/cylinder "
        "actuator/plugin": "actuators that are neither motors nor servos",
        "default/equality default/tendon default/pair default/camera default/light "
        "default/muscle default/adhesion default/cylinder default/intvelocity": _PROGRAM,
    },
}
"""Elements that are left out with all that is below them."""


def left_out(root: Element) -> dict[str, dict[str, int]]:
    """Return the entries of a file that are not used: how many of each kind, by the reason.

    Args:
        root: of the file, with all that it includes.

    Example:
        >>> left_out(ElementTree.fromstring('<robot name="r"><link name="a" hue="red"/></robot>'))
        {'not part of the format as read by SEALS': {'robot/link@hue': 1}}
    """
    found: dict[str, dict[str, int]] = {}
    for kind, reason in entries(root):
        if reason:
            counts = found.setdefault(reason, {})
            counts[kind] = counts.get(kind, 0) + 1
    return found


def entries(root: Element) -> Iterator[tuple[str, str]]:
    """Yield every entry of a file: its kind, and why it is left out, empty if it is used."""
    yield from _walk(str(root.tag), root, "")


def _walk(dialect: str, element: Element, above: str) -> Iterator[tuple[str, str]]:
    tag = str(element.tag)
    branch = next(
        (
            why
            for words, why in _BRANCHES.get(dialect, {}).items()
            if _fits(f"{above}/{tag}", words)
        ),
        "",
    )
    if tag == "plugin":
        yield from _plug_in(element)
        return
    own = tag == "gazebo" or (dialect == "robot" and tag in ("link", "joint"))
    if branch and not own and not any(inner.tag == "plugin" for inner in element.iter()):
        for kind in _own(element, above) or [f"{above}/{tag}"]:
            yield kind, branch
        for inner in element.iter():
            if inner is not element:
                yield from ((kind, branch) for kind in _own(inner, tag))
        return
    for kind in _own(element, above):
        # why an entry is left out; empty if it is used
        tables = [(_USED.get(dialect, ""), ""), *_LEFT.get(dialect, {}).items()]
        yield kind, next((why for words, why in tables if _fits(kind, words)), UNKNOWN)
    for child in element:
        top = tag == "model" and above in ("sdf", "world") and child.tag == "pose"
        yield from _walk(dialect, child, "top" if top else tag)


def _own(element: Element, above: str) -> list[str]:
    """Kinds of an element's own attributes and text."""
    place = f"{above}/{element.tag}" if above else str(element.tag)
    found = [f"{place}@{key}" for key in element.attrib]
    return found + ([f"{place}#"] if (element.text or "").strip() else [])


def _fits(kind: str, words: str) -> bool:
    """Return whether a kind is one of some patterns, with or without the element above."""
    short = kind.split("/", 1)[-1]
    return any(fnmatchcase(kind, word) or fnmatchcase(short, word) for word in words.split())


def _plug_in(plugin: Element) -> Iterator[tuple[str, str]]:
    """Entries of a plug-in: keys that a law is made of, and others."""
    for element in plugin.iter():
        used = element.tag in _PLUGIN_KEYS or re.fullmatch(_HYDRO, element.tag)
        named = element is plugin or element.tag == "link"
        why = _TELLING if element.tag in _TOLD else KEY
        for kind in _own(element, "" if element is plugin else "plugin"):
            yield kind, "" if used or (named and "@" in kind) else why
