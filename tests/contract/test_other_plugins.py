"""Every installed backend, wave, sensor, robot and reader keeps the contract of its kind."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals import registry
from seals.environment.waves import Sea
from seals.errors import MissingExtra
from seals.logs import Log
from seals.plugins.sensors.imu import SensorImu
from seals.plugins.sensors.modem import SensorModem
from seals.plugins.waves.airy import WaveAiry
from seals.plugins.waves.sea import Spectrum
from seals.testing import (
    ContractError,
    check_backend,
    check_reader,
    check_robot,
    check_sensor,
    check_waves,
)
from seals.testing.__main__ import main


@pytest.mark.parametrize("name", registry.names("backend"))
def test_an_installed_backend_keeps_the_contract(name: str) -> None:
    """Placement, free fall, momentum, and exact continuation from a snapshot."""
    try:
        report = check_backend(name)
    except MissingExtra as absent:
        pytest.skip(str(absent))
    assert report.placed < 1e-9
    assert report.angular < 1e-3


@pytest.mark.parametrize("name", registry.names("wave"))
def test_an_installed_wave_keeps_the_contract(name: str) -> None:
    """Normal, rise, velocity and acceleration belong to one surface."""
    assert check_waves(name).figures["normal"] < 1e-6


@pytest.mark.thorough
@pytest.mark.parametrize("name", registry.names("sensor"))
def test_an_installed_sensor_keeps_the_contract(name: str) -> None:
    """Readings when due, the same log for the same seed, the physics and the noise declared."""
    assert check_sensor(name).channels


@pytest.mark.parametrize("name", registry.names("robot"))
def test_an_installed_robot_keeps_the_contract(name: str) -> None:
    """The folder composes and builds, with masses and inertias that can exist."""
    assert check_robot(name).mass > 0.0


@pytest.mark.parametrize("name", registry.names("reader"))
def test_an_installed_reader_refuses_what_is_no_log(name: str) -> None:
    """Missing, empty and senseless sources are refused in words."""
    assert check_reader(name).logs == 0


def test_a_reader_is_checked_on_a_table(tmp_path: Path) -> None:
    """A hand-written table becomes one usable log of SI columns."""
    rows = [f"{10 * k},{90.0 + 0.1 * ((7 * k) % 5)}" for k in range(60)]
    (tmp_path / "turn.csv").write_text("\n".join(["ms,yaw_rate", *rows]))
    values = {
        "columns": {"ms": "t", "yaw_rate": "angular_velocity_z"},
        "units": {"ms": "ms", "yaw_rate": "deg/s"},
    }
    report = check_reader("csv", tmp_path / "turn.csv", values=values)
    assert (report.logs, report.rows, report.channels) == (1, 60, ("angular_velocity",))


@dataclass(kw_only=True)
class ReaderCareless:
    """Reads anything.

    Channels:
        One.
    Units:
        None.
    Limitations:
        It believes everything.
    """

    path: str = ""

    def read(self, source: Any = None) -> list[Log]:
        """Return a log whatever the source."""
        return [Log(name="x", columns={"t": np.array([0.0, 1.0])})]


def test_a_careless_reader_is_refused() -> None:
    """A reader that finds a log in a missing file is named."""
    with pytest.raises(ContractError, match=r"reads 1 logs from absent\.csv"):
        check_reader(ReaderCareless)


class WaveLeaning(WaveAiry):  # noqa: D101  that of its parent
    __doc__ = WaveAiry.__doc__

    def at(self, position: Any, time: Any, level: float) -> Sea:
        """Return the sea with its normal turned the wrong way."""
        sea = super().at(position, time, level)
        return sea._replace(normal=sea.normal * np.array([[-1.0, -1.0, 1.0]]))


class WaveHeavy(WaveAiry):  # noqa: D101  that of its parent
    __doc__ = WaveAiry.__doc__

    def at(self, position: Any, time: Any, level: float) -> Sea:
        """Return the sea with the acceleration of another wave."""
        sea = super().at(position, time, level)
        assert sea.acceleration is not None
        return sea._replace(acceleration=1.01 * sea.acceleration)


@pytest.mark.parametrize(("wave", "words"), [(WaveLeaning, "normal"), (WaveHeavy, "acceleration")])
def test_a_wrong_wave_is_refused(wave: type, words: str) -> None:
    """A turned normal and an acceleration 1 % off are found."""
    with pytest.raises(ContractError, match=f"its {words} is"):
        check_waves(wave)


def test_a_spread_sea_keeps_the_contract() -> None:
    """Waves of many directions together have the derivatives of their elevation."""
    values = {"height": 0.5, "period": 4.0, "components": 15, "spreading": 4.0, "direction": 0.7}
    values |= {"spectrum": Spectrum.jonswap}
    assert check_waves("sea", values=values).figures["acceleration"] < 1e-5


@pytest.mark.parametrize("direction", [0.7, -2.0])
def test_a_wave_from_any_side_keeps_the_contract(direction: float) -> None:
    """A long crest running in any direction has the derivatives of its elevation."""
    values = {"amplitude": 0.4, "period": 4.0, "direction": direction, "phase": 1.0}
    assert check_waves("airy", values=values).figures["acceleration"] < 1e-5


@dataclass(kw_only=True)
class SensorLoud(SensorImu):  # noqa: D101  that of its parent
    __doc__ = SensorImu.__doc__

    def __post_init__(self) -> None:
        """Make the noise 6 % louder than declared."""
        super().__post_init__()
        self._sigma = self._sigma * 1.06


@dataclass(kw_only=True)
class SensorCoordinate(SensorImu):  # noqa: D101  that of its parent
    __doc__ = SensorImu.__doc__

    def ideal(self, felt: Any) -> Any:
        """Report coordinate acceleration in place of specific force."""
        return super().ideal(felt) - np.array([[0.0, 0.0, 9.81], [0.0, 0.0, 0.0]])


@dataclass(kw_only=True)
class SensorRestless(SensorModem):  # noqa: D101  that of its parent
    __doc__ = SensorModem.__doc__

    def sense(self, felt: Any, memory: Any, rng: np.random.Generator, *, due: bool) -> Any:
        """Draw whether a message is due or not."""
        rng.random()
        return super().sense(felt, memory, rng, due=due)


@dataclass(kw_only=True)
class SensorDeaf(SensorModem):  # noqa: D101  that of its parent
    __doc__ = SensorModem.__doc__

    def sense(self, felt: Any, memory: Any, rng: np.random.Generator, *, due: bool) -> Any:
        """Hear nothing."""
        return None, memory


@pytest.mark.parametrize(
    ("sensor", "words"),
    [
        (SensorLoud, "noise is"),
        (SensorCoordinate, "specific_force .* at rest"),
        (SensorRestless, "draws noise when no reading is due"),
        (SensorDeaf, "gives nothing within 500 steps"),
    ],
)
def test_a_wrong_sensor_is_refused(sensor: type, words: str) -> None:
    """Noise 6 % above the declared, zero at rest, draws too often, and silence are found."""
    with pytest.raises(ContractError, match=words):
        check_sensor(sensor)


def test_a_robot_that_cannot_be_is_refused(pebble: Path) -> None:
    """A link with mass and no inertia about an axis is named."""
    urdf = pebble / "pebble.urdf"
    flat = urdf.read_text().replace('ixx="3e-4"', 'ixx="0"').replace('iyy="3e-4"', 'iyy="3e-4"')
    urdf.write_text(flat)
    with pytest.raises(ContractError, match="inertia about every axis"):
        check_robot(pebble)


@pytest.fixture
def engine() -> type:
    """A backend that forgets a part of its state in snapshots."""
    from seals.plugins.backends.pybullet import BackendPybullet

    class Forgetful(BackendPybullet):
        def restore(self, snapshot: Any) -> None:
            """Restore the engine's state only."""
            self._engine.restoreState(stateId=snapshot[0].number, physicsClientId=self._client)

    return Forgetful


def test_a_forgetful_backend_is_refused(engine: type) -> None:
    """A backend that loses its half-step velocities in a snapshot is found."""
    with pytest.raises(ContractError, match="continued from a snapshot"):
        check_backend(engine)


def test_the_command_prints_figures_and_refuses_in_words(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """``python -m seals.testing`` prints a table, or two lines and exit code 2."""
    assert main(["wave", "airy"]) == 0
    assert "acceleration" in capsys.readouterr().out
    assert main(["wafe"]) == 2
    assert "Did you mean 'wave'?" in capsys.readouterr().err
    assert main(["effect", "gravitty"]) == 2
    assert "Did you mean 'gravity'?" in capsys.readouterr().err
