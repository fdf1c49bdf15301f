"""Conversion of an MJCF model, compiled by MuJoCo in memory, to a URDF."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from seals.arrays import Floats
from seals.control.plant import ROTOR, THRUSTER
from seals.errors import RobotError
from seals.frames import matrix_of
from seals.scaffold.meshes import COMPILED
from seals.scaffold.mjcf_bounds import bounded_mjcf
from seals.scaffold.plug_ins import Motor, Stated
from seals.scaffold.urdf import (
    WORLD,
    Element,
    cylinder_element,
    inertial_element,
    joint_element,
    pose_at,
    pose_text,
)

_FREE, _BALL, _SLIDE = 0, 1, 2
_MESH = 7
_ON_JOINT, _ON_SITE = (0, 1), 4


def urdf_of_mjcf(
    path: Path, root: Element, packages: Mapping[str, Path]
) -> tuple[Element, list[str], Stated, dict[str, str]]:
    """Return the URDF of the largest robot in an MJCF file.

    Bodies become links whose origin is that of their joint; bodies with several joints get links
    without mass in between.

    Args:
        path: of the file.
        root: its ``<mujoco>`` element.
        packages: folders of ``package://`` names.

    Returns:
        The ``<robot>`` element; changes in words; rotors, thrusters and servos of the actuators;
        OBJ texts of meshes by name, to which the URDF refers as ``compiled://NAME``.

    Raises:
        RobotError: MuJoCo cannot compile it, or it holds what no URDF can say.
    """
    bounded = bounded_mjcf(path, root, packages)
    text, changes = bounded.text, bounded.changes
    model = _compiled(path, text, bounded.stand_ins(1.0))
    if model.nbody < 2:
        raise RobotError(f"MJCF {path} contains no body.\nA robot needs at least one <body>.")
    if bounded.missing:
        # refuse missing meshes whose bodies take their mass from them: stand-ins of two sizes tell
        other = _compiled(path, text, bounded.stand_ins(2.0))
        for body in np.flatnonzero(~np.isclose(model.body_mass, other.body_mass, rtol=1e-9)):
            geoms = np.flatnonzero((model.geom_bodyid == body) & (model.geom_type == _MESH))
            names = [str(model.mesh(model.geom_dataid[geom]).name) for geom in geoms]
            file = next(bounded.missing[name] for name in names if name in bounded.missing)
            raise RobotError(
                f"mesh '{file}' of {path} does not exist; "
                f"'{model.body(body).name}' gets its mass from it.\n"
                "Put the mesh there, or state the mass in an <inertial> of the body."
            )
    made = _Conversion(path, model, root.get("model") or path.stem, bounded.missing)
    made.run()
    # MuJoCo fills what a keyframe leaves out with zeros
    counts = [len(e.get("qpos", "").split()) for e in ElementTree.fromstring(text).iter("key")]
    made.keyframe([k for k, count in enumerate(counts[: model.nkey]) if count == model.nq])
    changes = ["MJCF model converted to URDF", *changes, *made.changes]
    return made.urdf, changes, made.stated, made.meshes


def _compiled(path: Path, text: str, assets: dict[str, bytes]) -> Any:
    """Compile a model, or say in words why not."""
    import mujoco

    try:
        return mujoco.MjModel.from_xml_string(text, assets)
    except (ValueError, mujoco.FatalError) as cause:
        words = " ".join(str(cause).split())[:200]
        raise RobotError(
            f"MJCF {path} cannot be compiled: {words}.\nCheck it with MuJoCo."
        ) from cause


class _Conversion:
    """One conversion: the compiled model and the URDF made from it."""

    def __init__(self, path: Path, model: Any, name: str, missing: Mapping[str, str]) -> None:
        self.path, self.model, self.missing = path, model, missing
        self.urdf = ElementTree.Element("robot", {"name": name})
        self.changes: list[str] = []
        self.stated = Stated()
        self.meshes: dict[str, str] = {}
        self.shift: dict[int, Floats] = {}

    def run(self) -> None:
        """Fill the URDF."""
        m = self.model
        m = self.model
        tops = [b for b in range(1, m.nbody) if m.body_parentid[b] == 0]
        floating = [b for b in tops if self._free(b)]
        size = {b: sum(self._below(k, b) for k in range(1, m.nbody)) for b in tops}
        base = max(floating or tops, key=lambda b: size[b])
        own = [b for b in range(1, m.nbody) if self._below(b, base)]
        if m.nbody - 1 > len(own):
            self.changes.append(f"{m.nbody - 1 - len(own)} further bodies left out")
        free = self._free(base)
        if not free:
            self.urdf.set("fixed_base", "true")
        if not free and m.body_jntnum[base]:
            # a rig: hinges and slides between the world and the robot are the first of its joints
            ElementTree.SubElement(self.urdf, "link", name=WORLD)
            self.shift[0] = np.zeros(3)
        for body in own:
            joints = range(m.body_jntadr[body], m.body_jntadr[body] + m.body_jntnum[body])
            joints = range(0) if body == base and free else joints
            self.shift[body] = m.jnt_pos[joints[-1]].copy() if joints else np.zeros(3)
            self._link(body)
            if body != base or joints:
                self._joints(body, list(joints))
        for actuator in range(m.nu):
            self._actuator(actuator, set(own))

    def keyframe(self, whole: list[int]) -> None:
        """Read the joint values of the keyframe for standing, else of the first one.

        Args:
            whole: keyframes that state every coordinate.
        """
        m = self.model
        part = [str(m.key(k).name) or str(k) for k in range(m.nkey) if k not in whole]
        if part:
            counts = f"{m.nq} numbers are expected in qpos"
            self.changes.append(f"keyframes left out: {', '.join(part[:6])}; {counts}")
        if not whole:
            return
        names = {k: str(m.key(k).name).lower() for k in whole}
        key = next((k for k, n in names.items() if "home" in n or "stand" in n), whole[0])
        for joint in range(m.njnt):
            if int(m.jnt_bodyid[joint]) in self.shift and m.jnt_type[joint] not in (_FREE, _BALL):
                at = m.jnt_qposadr[joint]
                value = float(m.key_qpos[key, at] - m.qpos0[at])
                self.stated.pose[self._name("joint", joint)] = value

    def _name(self, kind: str, index: int) -> str:
        return str(getattr(self.model, kind)(index).name) or f"{kind}_{index}"

    def _free(self, body: int) -> bool:
        m = self.model
        return bool(m.body_jntnum[body]) and m.jnt_type[m.body_jntadr[body]] == _FREE

    def _below(self, body: int, top: int) -> bool:
        while body > top:
            body = int(self.model.body_parentid[body])
        return body == top

    def _link(self, body: int) -> None:
        m = self.model
        link = ElementTree.SubElement(self.urdf, "link", name=self._name("body", body))
        if m.body_mass[body] > 0.0:
            pose = _pose(m.body_ipos[body] - self.shift[body], m.body_iquat[body])
            tensor = np.diag(m.body_inertia[body])
            link.append(inertial_element(m.body_mass[body], tensor, pose_text(pose)))
        for geom in range(m.body_geomadr[body], m.body_geomadr[body] + m.body_geomnum[body]):
            shape = self._shape(geom)
            if shape is not None:
                touches = m.geom_contype[geom] or m.geom_conaffinity[geom]
                part = ElementTree.SubElement(link, "collision" if touches else "visual")
                placed = _pose(m.geom_pos[geom] - self.shift[body], m.geom_quat[geom])
                ElementTree.SubElement(part, "origin", pose_text(placed))
                ElementTree.SubElement(part, "geometry").append(shape)

    def _shape(self, geom: int) -> Element | None:
        m = self.model
        kind, size = int(m.geom_type[geom]), m.geom_size[geom]
        if kind == _MESH:
            index = int(m.geom_dataid[geom])
            file = self.missing.get(str(m.mesh(index).name))
            return ElementTree.Element("mesh", {"filename": file or COMPILED + self._mesh(index)})
        if kind == 2:
            return ElementTree.Element("sphere", {"radius": f"{size[0]:.9g}"})
        if kind in (4, 6):
            # an ellipsoid becomes a box of its volume and proportions
            edges = 2.0 * size * ((np.pi / 6.0) ** (1.0 / 3.0) if kind == 4 else 1.0)
            return ElementTree.Element("box", {"size": " ".join(f"{x:.9g}" for x in edges)})
        if kind in (3, 5):
            return cylinder_element(float(size[0]), 2.0 * float(size[1]), capped=kind == 3)
        return None

    def _mesh(self, index: int) -> str:
        m = self.model
        name = "".join(c if c.isalnum() else "_" for c in self._name("mesh", index))
        if name not in self.meshes:
            first, count = m.mesh_vertadr[index], m.mesh_vertnum[index]
            rows = [f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in m.mesh_vert[first : first + count]]
            first, count = m.mesh_faceadr[index], m.mesh_facenum[index]
            rows += [f"f {a} {b} {c}" for a, b, c in m.mesh_face[first : first + count] + 1]
            self.meshes[name] = "\n".join(rows) + "\n"
        return name

    def _joints(self, body: int, joints: list[int]) -> None:
        m = self.model
        parent, name = int(m.body_parentid[body]), self._name("body", body)
        pose = _pose(m.body_pos[body] - self.shift[parent], m.body_quat[body])
        above = self._name("body", parent)
        if not joints:
            self.urdf.append(joint_element(f"{name}_fixed", "fixed", above, name, pose))
        before = np.zeros(3)
        for number, joint in enumerate(joints):
            kind = int(m.jnt_type[joint])
            if kind in (_FREE, _BALL):
                words = "a free joint inside the robot" if kind == _FREE else "a ball joint"
                raise RobotError(
                    f"MJCF {self.path}: body '{name}' has {words}, which a URDF cannot describe.\n"
                    "Allowed: hinge and slide; replace a ball joint by three hinges."
                )
            child = name if number == len(joints) - 1 else f"{name}_{number + 1}"
            if child != name:
                ElementTree.SubElement(self.urdf, "link", name=child)
            origin = pose if number == 0 else np.eye(4)
            step = m.jnt_pos[joint] - before
            origin = origin @ _pose(step, np.array([1.0, 0.0, 0.0, 0.0]))
            self.urdf.append(self._joint(joint, above, child, origin))
            turned, called = m.jnt_dofadr[joint], self._name("joint", joint)
            self.stated.damping[called] = float(m.dof_damping[turned])
            self.stated.armature[called] = float(m.dof_armature[turned])
            above, before = child, m.jnt_pos[joint]

    def _joint(self, joint: int, parent: str, child: str, origin: Floats) -> Element:
        m = self.model
        low, high = m.jnt_range[joint] if m.jnt_limited[joint] else (-1e3, 1e3)
        # the URDF's zero is the pose as drawn, where MuJoCo's joint has its reference value
        low, high = (float(x - m.qpos0[m.jnt_qposadr[joint]]) for x in (low, high))
        slides = m.jnt_type[joint] == _SLIDE
        kind = "prismatic" if slides else "revolute" if m.jnt_limited[joint] else "continuous"
        effort = 0.0
        for k in range(m.nu):
            if m.actuator_trntype[k] in _ON_JOINT and m.actuator_trnid[k, 0] == joint:
                bounds = m.actuator_forcerange[k] if m.actuator_forcelimited[k] else np.zeros(2)
                if (
                    not m.actuator_forcelimited[k]
                    and not m.actuator_biastype[k]
                    and m.actuator_ctrllimited[k]
                ):
                    bounds = m.actuator_gainprm[k, 0] * m.actuator_ctrlrange[k]
                effort = float(np.abs(bounds * m.actuator_gear[k, 0]).max())
        limits = {"lower": low, "upper": high, "effort": effort, "velocity": 0.0}
        name = self._name("joint", joint)
        return joint_element(
            name, kind, parent, child, origin, axis=m.jnt_axis[joint], limits=limits
        )

    def _actuator(self, k: int, own: set[int]) -> None:
        m = self.model
        name, kind = self._name("actuator", k), int(m.actuator_trntype[k])
        if kind in _ON_JOINT:
            joint = int(m.actuator_trnid[k, 0])
            self.stated.driven.add(self._name("joint", joint))
            if m.actuator_biastype[k] and m.actuator_gainprm[k, 0] > 0.0:
                damping = -float(m.actuator_biasprm[k, 2]) + float(
                    m.dof_damping[m.jnt_dofadr[joint]]
                )
                self.stated.servos[self._name("joint", joint)] = (
                    float(m.actuator_gainprm[k, 0]),
                    damping,
                )
            return
        site = int(m.actuator_trnid[k, 0]) if kind == _ON_SITE else -1
        force, torque = m.actuator_gear[k, :3], m.actuator_gear[k, 3:]
        size, limited = float(np.linalg.norm(force)), bool(m.actuator_ctrllimited[k])
        if site < 0 or int(m.site_bodyid[site]) not in own or size < 1e-9 or not limited:
            why = " (no ctrlrange)" if site >= 0 and size >= 1e-9 and not limited else ""
            self.stated.unread.append(f"actuator {name}{why}")
            return
        body = int(m.site_bodyid[site])
        turn = matrix_of(m.site_quat[site][None][:, [1, 2, 3, 0]])[0]
        low, high = m.actuator_ctrlrange[k] * float(m.actuator_gainprm[k, 0]) * size
        ahead = force / size
        values = {"max_force": float(max(high, -low)), "back_force": abs(float(low))}
        moment = float(torque @ ahead) / size
        if moment:
            # the reaction of the air on the body, against the sense of rotation
            values |= {"moment": abs(moment), "direction": -float(np.sign(moment))}
        place = _triple(m.site_pos[site] - self.shift[body])
        axis = _triple(turn @ ahead)
        rotor = low >= 0.0
        said = "actuators at sites of the MJCF"
        link = self._name("body", body)
        self.stated.motors.append(
            Motor(ROTOR if rotor else THRUSTER, link, "", values, said, place, axis)
        )


def _triple(values: Floats) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _pose(position: Floats, q_wxyz: Floats) -> Floats:
    return pose_at(position, matrix_of(np.asarray(q_wxyz)[None][:, [1, 2, 3, 0]])[0])
