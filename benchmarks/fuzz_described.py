"""Fuzz targets: descriptions of vehicles, motors, answers and models with entries of odd kinds.

A sound tree of plain data gets entries that are of another kind, huge, not finite or missing: each
file is sound YAML or JSON, and every key may hold anything.
"""

from __future__ import annotations

import contextlib
import copy
import functools
import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import yaml

from benchmarks.fuzz_targets import URDF, Target, checked, parquet_of, robot_folder

_ODD: tuple[Any, ...] = (
    *(None, True, "", "a", "nan", "1e999", "\x1b[2J", "a\nb: 1", "../../a", "x" * 2000),
    *([], {}, [1], [[1], [1, 2]], [None], ["a"], {"a": 1}, {"value": None}, [{}], [[[]]]),
    *(-1, 0, 1e-320, 1e308, math.nan, math.inf, -math.inf, 1 << 70, 10**350, 2.5),
)
_ROTOR = {"position": [0.1, 0.1, 0.0], "axis": [0, 0, 1], "direction": 1.0}
_ROTOR |= {"thrust_coefficient": 1e-5, "torque_coefficient": 1e-7, "time_constant": 0.05}
_ROTOR |= {"radius": 0.1, "max_speed": 900.0}
_MOTORS = {"command": "pwm", "range": [1000, 2000], "thrust_factor": 0.5, "full_voltage": 16.8}
_MOTORS |= {"voltage_power": 1.0, "order": [1, 2, 3, 4], "points": [[0, 0], [0.5, 500], [1, 900]]}
_MOMENT = {"value": 9.0, "low90": 8.9, "high90": 9.1}


def places(tree: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the path of every entry of a tree."""
    items = tree.items() if isinstance(tree, dict) else enumerate(tree)
    for key, value in items:
        yield (*path, key)
        if isinstance(value, dict | list):
            yield from places(value, (*path, key))


def bent(data: Random, tree: Any) -> Any:
    """Draw a copy of a tree with one to three entries odd, missing or misnamed."""
    tree = copy.deepcopy(tree)
    for _ in range(data.randint(1, 3)):
        *above, key = data.choice(list(places(tree)))
        node = functools.reduce(lambda part, name: part[name], above, tree)
        kind = data.randint(0, 5)
        if kind == 0:
            del node[key]
        elif kind == 1 and isinstance(node, dict):
            node[data.choice(("", "a", "_target_", "name", "\n"))] = node.pop(key)
        else:
            node[key] = copy.deepcopy(data.choice(_ODD))
        if not tree:
            break
    return tree


def _yaml(tree: Any) -> bytes:
    return yaml.safe_dump(tree, allow_unicode=True).encode("utf-8", "surrogatepass")


def _json(tree: Any) -> bytes:
    return json.dumps(tree).encode()


def _target(
    tree: Any, name: str, load: Callable[[Path], Any], *, form: Callable[[Any], bytes] = _yaml
) -> Target:
    """Return a target whose files are a tree with odd entries."""
    return Target(whole=form(tree), name=name, load=load, draw=lambda data: form(bent(data, tree)))


def _flight() -> tuple[dict[str, Any], dict[str, Any]]:
    """Metadata and columns of the start of a shipped flight."""
    from seals.logs.native import read_native
    from seals.logs.shipped import shipped_logs

    log = read_native(shipped_logs()["hidden_effect/flight_a"])
    return log.meta, {key: values[:200] for key, values in log.columns.items()}


def _vehicle() -> Target:
    """Description of the vehicle in a log, up to its stated model."""
    from seals.logs import Log, refuse_if_bad
    from seals.logs.native import read_meta
    from seals.sysid.data.join import join_logs
    from seals.sysid.data.samples import read_samples
    from seals.sysid.data.vehicle import read_vehicle

    meta, columns = _flight()

    def load(path: Path) -> None:
        log = Log(name="a", columns=columns, meta=read_meta(path))
        refuse_if_bad(log)
        for one in (log, join_logs([log, log])):
            read_samples(one, read_vehicle(one.meta))

    return _target({"format": "hidden-effect-log", "format_version": 1, **meta}, "meta.yaml", load)


def _motors() -> Target:
    """Motor curve and rotors of a log or a data sheet; the data sheet that a flight writes."""
    from seals.cli.convert import adapted
    from seals.config.compose import compose
    from seals.logs import Log
    from seals.scaffold.datasheet import write_datasheet
    from seals.untrusted_io import read_yaml

    time = np.arange(300) / 100
    columns = {f"motor_pwm_{k}": 1500 + 100 * np.sin(time + k) for k in (1, 2, 3, 4)}
    columns |= {"t": time, "battery_voltage": 16.0 - 0.01 * time, "specific_force_z": 9.81 + time}
    config = compose(["reader=native", "rate=50"], root="convert")
    tree = {"motors": _MOTORS, "motor_command": "pwm", "vehicle": {"rotors": [_ROTOR] * 4}}

    def load(path: Path) -> None:
        sheet = path.with_name("datasheet.yaml")
        log = Log(name="a", columns=columns, meta=read_yaml(path))
        log, _ = adapted(log, config, {})
        write_datasheet(log, {"name": "a", "mass": 1.0}, sheet, replace=True)
        known = {"environment", "baseline", "battery", "sensors", "tolerance", "disturbance"}
        assert read_yaml(sheet).keys() <= {*known, "motors"}

    return _target(tree, "meta.yaml", load)


def _timed() -> dict[str, Any]:
    """Answer of a diagnosis with an effect that acts for a time."""
    spans = [{"log": "a", "start": _MOMENT, "end": None}, {"log": "b", "start": None, "end": None}]
    parameters = {"mass": {"value": 0.3, "low90": 0.2, "high90": 0.4, "sd": 0.1, "unit": "kg"}}
    effect = {"name": "payload", "link": 0, "medium": "air", "parameters": parameters}
    law = {"name": "formula", "medium": "air", "parameters": {"force_x": 0.1}}
    return {
        "verdict": "named",
        "effects": [{**effect, "active": spans}],
        "ambiguous_with": [["payload", "thrust_coefficient"]],
        "nominal": {"mass": {"value": 0.1, "sd": 0.2}},
        "covariance": {"parameters": ["effects.0.mass"], "matrix": [[0.01]]},
        "formula": {"text": "f", "effect": law},
        "models": {"payload": {k: v for k, v in _MODEL.items() if k != "summary"}},
        "log": {"path": "flight_a", "sha256": "0" * 64},
        "reasons": ["because"],
    }


def _answer() -> Target:
    """Answer of a diagnosis, read by all verbs that take one."""
    from seals.config.overlay import read_overlay
    from seals.effects.effect import Effect
    from seals.errors import ConfigError
    from seals.learn.environments.posterior import posterior_of
    from seals.registry import get
    from seals.sysid.validation.answer import load_answer, read_answer
    from seals.sysid.validation.writing import overlay_of, timed_words

    payload: Effect = get("effect", "payload").load()(mass=0.1)

    def load(path: Path) -> None:
        for effect in read_answer(path).effects:
            timed_words(effect)
        with contextlib.suppress(ConfigError):
            read_overlay(overlay_of(read_answer(path), {}, source={}))
        with contextlib.suppress(ConfigError):
            posterior_of(path, {"load": payload})
        load_answer(path)

    return _target(_timed(), "diagnosis.json", load, form=_json)


_MODEL = {
    "summary": "a",
    "effects": {"drag": {"effect": "quadratic_drag", "medium": "water", "coefficient_x": 2.0}},
    "changes": {"load": {"effect": "payload", "links": ["base"], "mass": 0.1}},
    "wave": {"wave": "airy", "amplitude": 0.1},
    "intervals": {"drag": {"coefficient_x": [1.5, 2.5]}},
    "nominal": {"mass": {"value": 0.1, "sd": 0.02, "alone": 0.3}},
    "speeds": [0.5, 1.0],
    "provenance": {"log": "flight_a", "verdict": "named", "log_sha256": "0", "vehicle": "a"},
}


def _model() -> Target:
    """Model of a diagnosis, added to the effects of a robot."""
    from seals.config.overlay import load_overlay, read_overlay
    from seals.registry import get
    from seals.sysid.validation.ablation import replay_count

    own = {"payload": get("effect", "payload").load()(mass=0.1, links=["base"])}

    def load(path: Path) -> None:
        overlay = read_overlay(load_overlay(path))
        replay_count(overlay)
        overlay.applied(own)

    return _target(_MODEL, "a.yaml", load)


_SHEET = {
    "urdf": "r.urdf",
    "hulls": {"base": {"shapes": [{"type": "box", "size": [1, 1, 1]}]}},
    "effects": {"buoyancy": {"effect": "buoyancy"}, "drag": {"effect": "quadratic_drag"}},
    "sensors": {"imu": {"sensor": "imu", "link": "root"}},
    "actuators": {"rotors": {"actuator": "rotors", **{k: [v] * 4 for k, v in _ROTOR.items()}}},
}
_SHEET["actuators"]["rotors"].pop("axis")


def first_step(*words: str) -> Callable[[Path], None]:
    """Return what loads a robot's folder into a world, up to the first step of its engine."""
    from seals.api import make

    def load(folder: Path) -> None:
        world = make([f"robot='{folder}'", *words])
        try:
            world.step()
        finally:
            world.close()

    return load


def _robot(backend: str) -> Target:
    """Folder of a robot, up to the first step in an engine."""
    load = first_step(f"backend={backend}")
    return robot_folder(_yaml(_SHEET), load, lambda data: _yaml(bent(data, _SHEET)))


_NUMBERS = ("0", "-1", "1e-320", "1e308", "nan", "1e400", "", "a", "1 1", "1e-9", "1e9")
_PLACES = ('value="1"', 'ixx="1"', 'ixy="0"', 'size="1 1 1"', 'xyz="0 0 0"', 'rpy="0 0 0"')
_NAMES = ("a/0", "0/", "a b", "\u202e", "&quot;/&gt;&lt;include file=&quot;/dev/zero", "x" * 5000)


def _scene(data: Random) -> bytes:
    """Draw a URDF whose numbers and names are odd, with more links, contacts and joints."""
    text = URDF
    for _ in range(data.randint(0, 2)):
        place = data.choice(_PLACES)
        name = place.partition("=")[0]
        text = text.replace(place, f'{name}="{data.choice(_NUMBERS)}"', 1)
    name, number = data.choice(_NAMES), data.choice(_NUMBERS)
    contact = f'<contact><lateral_friction value="{number}"/></contact>'
    shape = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
    inertial = text[text.index("<inertial>") : text.index("<collision>")]
    more = f'<link name="{name}">{inertial}{contact}{shape * data.choice((0, 1, 40))}</link>'
    more += f'<joint name="{name}" type="{data.choice(("revolute", "prismatic", "continuous"))}">'
    axis = data.choice(("0 0 0", "0 0 1"))
    more += f'<parent link="base"/><child link="{name}"/><axis xyz="{axis}"/>'
    more += f'<limit lower="{data.choice(_NUMBERS)}" upper="1" effort="1" velocity="1"/></joint>'
    return text.replace("</robot>", f"{more if data.randint(0, 3) else ''}</robot>").encode()


def _mujoco() -> Target:
    load = first_step("backend=mujoco")
    return Target(
        whole=URDF.encode(), name="r.urdf", load=load, draw=_scene, folder=True,
        beside={"robot.yaml": b"urdf: r.urdf\n"},
    )  # fmt: skip


def _edited() -> Target:
    """Text of a robot's file with calibrated numbers."""
    from seals.errors import ConfigError
    from seals.robot.robot_file import read_robot
    from seals.robot.yaml_edit import holds, with_entry, with_number

    path = ("actuators", "rotors", "thrust_coefficient")

    def load(folder: Path) -> None:
        read_robot(folder)
        text = (folder / "robot.yaml").read_text()
        with contextlib.suppress(ConfigError):
            if holds(text, path):
                with_number(text, path, lambda x: 2.0 * x)
            else:
                with_entry(text, path, "2.0")

    def drawn(data: Random) -> bytes:
        text = yaml.safe_dump(
            bent(data, _SHEET), default_flow_style=data.choice((True, False, None))
        )
        anchored = text.replace("thrust_coefficient:", "thrust_coefficient: &a", 1)
        return data.choice(
            (text, anchored, text.replace("1.0e-05", "0x10"), f"<<: {{}}\n{text}")
        ).encode()

    return robot_folder(_yaml(_SHEET), load, drawn)


def _flights(name: str, needed: list[str], reader: Any) -> Target:
    """Table of a published flight: columns of any type, length and content."""

    def drawn(data: Random) -> bytes:
        rows = data.choice((0, 1, 2, 60))
        kinds = (
            lambda: np.arange(rows) * 0.01,
            lambda: np.full(rows, data.choice((np.nan, np.inf, -1e300, 1e300, 0.0))),
            lambda: ["a"] * rows,
            lambda: np.full(rows, 2**62),
            lambda: [None] * rows,
            lambda: [[1.0]] * rows,
            lambda: [True] * rows,
        )
        made = {key: data.choice((kinds[0], *kinds))() for key in needed if data.randint(0, 40)}
        return parquet_of(made)

    sound = {key: np.arange(60) * 0.01 for key in needed}
    return Target(whole=parquet_of(sound), name=name, load=checked(reader), draw=drawn)


def _crazypad() -> Target:
    from seals.plugins.readers.crazypad import ReaderCrazypad

    needed = ["t_s", *(f"command_{k}" for k in (1, 2, 3, 4)), *(f"{a}_m" for a in "xyz")]
    more = ["battery_V", "accel_z_m_s2"]
    return _flights("a.parquet", [*needed, *more], ReaderCrazypad())


def _nanobench() -> Target:
    from seals.plugins.readers.nanobench import ReaderNanobench

    needed = ["t_s", "battery_V", *(f"q{a}" for a in "wxyz"), *(f"pwm_{k}" for k in (1, 2, 3, 4))]
    for a in "xyz":
        needed += [f"{a}_m", f"gyro_{a}_rad_s", f"accel_{a}_m_s2", f"ekf_{a}_m"]
    return _flights("a.parquet", needed, ReaderNanobench())


def _nanobench_csv() -> Target:
    from seals.plugins.readers.nanobench import _PUBLIC, ReaderNanobench

    lines = [",".join(_PUBLIC), *(",".join([str(k / 100)] * len(_PUBLIC)) for k in range(40))]
    return Target(whole="\n".join(lines).encode(), name="a.csv", load=checked(ReaderNanobench()))


DESCRIBED: dict[str, Callable[[], Target]] = {
    "described_vehicle": _vehicle,
    "described_motors": _motors,
    "described_answer": _answer,
    "described_model": _model,
    "described_robot": lambda: _robot("free"),
    "robot_edited": _edited,
    "mujoco_robot": lambda: _robot("mujoco"),
    "mujoco_urdf": _mujoco,
    "crazypad": _crazypad,
    "nanobench": _nanobench,
    "nanobench_csv": _nanobench_csv,
}
"""Descriptions with odd entries, and readers of published flights, by name."""
