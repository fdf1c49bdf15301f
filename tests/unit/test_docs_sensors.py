"""The page on sensors says what is installed."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest

from seals import registry
from seals.config.roots import recipe_groups
from seals.logs.channels import CHANNELS
from seals.logs.check_meta import check_meta
from seals.run import build_world
from seals.run.build import run_settings
from seals.run.recorder import Moment
from seals.run.robot_recorder import RobotRecorder
from seals.run.simulation import simulate
from seals.sensors.mount import MountedSensor
from seals.sysid.data.vehicle import READ, read_vehicle
from seals.testing.sensor import OUTFIT

PAGE = Path(__file__).parents[2] / "docs" / "sensors.md"
OURS = "aam-seals"


def row_of(name: str) -> str:
    """The row of one sensor: name, default rate, channels with width and unit."""
    cls = registry.get("sensor", name).load()
    sensor = cls()
    if hasattr(sensor, "bind"):
        sensor.bind(OUTFIT)
    channels = []
    for channel, width in sensor.channels().items():
        known = CHANNELS.get(channel)
        many = "n" if known is not None and known.numbered else str(width)
        unit = "" if known is None or known.unit == "1" else f" [{known.unit}]"
        channels.append(f"`{channel}` {many}{unit}")
    return f"| `{name}` | {sensor.rate:g} Hz | {', '.join(channels)} |"


@pytest.mark.parametrize(
    "name", [n for n, p in registry.plugins("sensor").items() if p.distribution == OURS]
)
def test_the_table_holds_every_sensor_as_it_is(name: str) -> None:
    """Name, rate, channels, widths and units are those of the class and of the log format."""
    assert row_of(name) in PAGE.read_text(encoding="utf-8")


def test_the_table_holds_no_other_sensor() -> None:
    """Every row is that of an installed sensor."""
    rows = re.findall(r"^\| `(\w+)` \| [\d.]+ Hz \|", PAGE.read_text(encoding="utf-8"), re.M)
    assert sorted(rows) == sorted(set(rows) & set(registry.names("sensor")))
    assert len(rows) > 8


def test_the_page_names_the_fields_that_all_share() -> None:
    """Link, latency, dropout and outage, and each set of senses, are on the page."""
    text = PAGE.read_text(encoding="utf-8")
    for field in dataclasses.fields(MountedSensor):
        assert f"`{field.name}`" in text
    for path in recipe_groups()["senses"]:
        assert f"+senses={path.stem}" in text


@pytest.mark.parametrize("name", ["auv", "aam"])
def test_a_log_of_a_set_of_senses_can_be_diagnosed(name: str) -> None:
    """Its description says of every channel what the check of a log asks for."""
    place = {"auv": "[0,0,-3]", "aam": "[0,0,1]"}[name]
    words = [f"robot={name}", f"+senses={name}", "water=fossen", "guide=hover"]
    words += [f"initial.position={place}", "environment.tank_bottom=-8", "time.duration=0.5"]
    record = simulate(run_settings(words))
    assert record.error is None
    assert check_meta(record.log) == []
    if not record.robot.joints:
        # a hand of three fingers is no arm that a diagnosis knows
        sigma = read_vehicle(record.log.meta).sigma
        assert {"depth", "velocity", "position"} <= set(sigma) <= set(READ)


@pytest.mark.parametrize("path", recipe_groups()["senses"], ids=lambda path: path.stem)
def test_a_set_of_senses_gives_columns_of_its_own(path: Path) -> None:
    """On the robot of its name it composes and builds; no two sensors share a column."""
    run = run_settings([f"robot={path.stem}", f"+senses={path.stem}", "water=fossen"])
    world = build_world(run)
    for _ in range(60):
        world.step()
    actor = world.actors["robot"]
    recorder = RobotRecorder(actor, steps=1, gravity=9.81, water_level=0.0)
    recorder.record(Moment(world, 0, world.time, dict))
    world.step()
    recorder.record(Moment(world, 1, world.time, dict))
    names = [f"{s}.{c}" for s, p in actor.sensors.items() for c in p.channels()]
    read = [name for name, sensor in recorder.sources().items() if sensor]
    world.close()
    assert len(read) == len(names) > 8
