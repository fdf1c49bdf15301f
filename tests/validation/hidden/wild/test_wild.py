"""The generator of whole robots against closed forms, conservation laws and its own files."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest

from tests.validation.hidden import fly, sensors, surroundings
from tests.validation.hidden.body import Body
from tests.validation.hidden.onsets import entered
from tests.validation.hidden.plant import Plant, stack
from tests.validation.hidden.rotation import Array, matrix
from tests.validation.hidden.vehicles import GRAVITY, WATER
from tests.validation.hidden.wild import folder, records, sea
from tests.validation.hidden.wild.cases import MAKERS, Case, Spec, build
from tests.validation.hidden.wild.tree import TreeBody

ZERO = np.zeros(1)


def _case(family: str, level: str = "null", effects: tuple[str, ...] = (), seed: int = 3) -> Case:
    return build(Spec(family, level, effects, 0.01, (seed,)))


def _at(*values: float) -> Array:
    return np.array(values, dtype=float)[:, None]


def _quiet(case: Case) -> Plant:
    """The nominal plant without drags."""
    plant = dict(case.nominal)
    for key in ("air_linear", "air_quadratic", "water_quadratic"):
        plant[key] = np.zeros(3)
    for key in ("angular_linear", "angular_quadratic"):
        plant[key] = np.zeros(3)
    return plant


@pytest.mark.parametrize("family", ["grip", "dual"])
def test_a_tree_in_free_flight_keeps_momentum_and_energy(family: str) -> None:
    """Loose joints on a tumbling base exchange momentum and energy, and lose none."""
    case = _case(family)
    tree, plant = case.robot.tree, _quiet(case)
    assert tree is not None
    m = len(tree.names)
    plant |= {"gravity": np.zeros(()), "servo_stiff": np.zeros(m), "servo_damp": np.zeros(m)}
    plant |= {"armature": np.zeros(m), "joint_start": np.full(m, 0.3)}
    plant |= {"payload_mass": np.array(0.2), "payload_link": np.array(1.0)}
    plant["payload_place"] = tree.tip
    with np.errstate(invalid="ignore"):
        body = TreeBody(stack([plant]), tree.parents, ground=None)
        state = body.still(
            _at(0, 0, 2), _at(1, 0, 0, 0), _at(0.3, 0.1, -0.2), _at(2, -1, 1.5), np.zeros((6, 1))
        )
        state[body.rate_rows, 0] = np.linspace(-3, 3, m)

        def kept(state: Array) -> Array:
            mass = body._chain(state, body.motion(state, ZERO)[0])[0][0]
            speed = np.concatenate((state[7:13, 0], state[body.rate_rows, 0]))
            push, turn = mass @ speed, matrix(state[3:7])[..., 0]
            line = turn @ push[:3]
            spin = turn @ push[3:6] + np.cross(state[:3, 0], line)
            return np.concatenate(([0.5 * speed @ push], line, spin))

        before = kept(state)
        seen = np.zeros((10, 1))
        for _ in range(200):
            command = np.concatenate((np.zeros((6, 1)), state[body.joint_rows]))
            state = fly.stepped(body, state, command, ZERO, 1e-3, seen)
    assert kept(state) == pytest.approx(before, rel=1e-5, abs=1e-6)
    assert np.abs(state[body.joint_rows, 0] - 0.3).max() > 0.1


def test_a_body_falls_about_its_centre_of_gravity() -> None:
    """In free fall the centre of gravity draws a parabola though the origin does not."""
    case = _case("hexa")
    body = Body(stack([_quiet(case)]), rotor=True, ground=None, water=False)
    centre = case.robot.vehicle.centre
    spin = _at(2.0, -1.0, 3.0)
    state = body.still(_at(0, 0, 9), _at(1, 0, 0, 0), _at(0, 0, 0), spin, np.zeros((6, 1)))
    first = centre + np.array([0.0, 0.0, 9.0])
    speed = np.cross(spin[:, 0], centre)
    seen = np.zeros((10, 1))
    for _ in range(400):
        state = fly.stepped(body, state, np.zeros((6, 1)), ZERO, 1e-3, seen)
    place = state[:3, 0] + matrix(state[3:7])[..., 0] @ centre
    expected = first + 0.4 * speed - np.array([0.0, 0.0, 0.5 * GRAVITY * 0.4**2])
    assert place == pytest.approx(expected, abs=2e-6)


def test_the_imu_reads_the_acceleration_of_its_own_place() -> None:
    """In free fall it reads twist x r + spin x (spin x r) about the centre of gravity."""
    case = _case("hexa")
    plant = stack([_quiet(case) | {"act_delay": np.array(1e-4)}])
    body = Body(plant, rotor=True, ground=None, water=False)
    spin = _at(2.0, -1.0, 3.0)
    state = body.still(_at(0, 0, 9), _at(1, 0, 0, 0), _at(0, 0, 0), spin, np.zeros((6, 1)))
    track, _ = fly.closed_loop(
        body,
        None,
        state,
        seconds=0.2,
        step=0.01,
        per_row=5,
        gusts=False,
        rng=np.random.default_rng(0),
    )
    read = sensors.exact(track, plant)["specific_force"][:, :, 0]
    v = case.robot.vehicle
    products = v.products
    inertia = np.diag(v.inertia)
    for value, (i, j) in zip(products, ((0, 1), (0, 2), (1, 2)), strict=True):
        inertia[i, j] = inertia[j, i] = value
    arm = v.imu - v.centre
    for row in (5, 12):
        w = track.fine[row * 5, 7:, 0]
        twist = np.linalg.solve(inertia, -np.cross(w, inertia @ w))
        expected = np.cross(twist, arm) + np.cross(w, np.cross(w, arm))
        assert read[row] == pytest.approx(expected, abs=2e-4)


def test_a_float_rests_at_its_draught_and_heaves_with_its_period() -> None:
    """Weight is lift at the draught; a small heave has the period of its water plane."""
    case = _case("float")
    plant, v = _quiet(case), case.robot.vehicle
    plant |= {"ripple": np.zeros((5, 3)), "wet_power": np.array(1.0)}
    body = Body(stack([plant]), rotor=False, ground=None, water=True)
    height = sea.afloat(v)
    state = body.still(
        _at(0, 0, height - 0.004), _at(1, 0, 0, 0), _at(0, 0, 0), _at(0, 0, 0), np.zeros((0, 1))
    )
    path, seen = [], np.zeros((10, 1))
    for _ in range(1000):
        path.append(state[2, 0] - height)
        state = fly.stepped(body, state, np.zeros((0, 1)), ZERO, 2e-3, seen)
    heave = np.array(path)
    up = np.flatnonzero((heave[:-1] < 0.0) & (heave[1:] >= 0.0))
    period = 2e-3 * np.diff(up).mean()
    size = v.primitives[0]["size"]
    carried = v.added[2] * v.mass / (WATER * v.volume)
    spring = WATER * GRAVITY * size[0] * size[1]
    assert period == pytest.approx(2 * np.pi * np.sqrt((v.mass + carried) / spring), rel=0.02)
    assert np.abs(heave).max() < 0.006


def test_a_released_payload_leaves_without_a_push() -> None:
    """Velocity and spin go on when the mass changes."""
    case = _case("hexa", "clear", ("payload",))
    log = case.logs[0]
    with_it = Body(stack([case.at(case.plant, log, None)]), rotor=True, ground=None, water=False)
    without = Body(
        stack([case.at(case.plant, log, None, bare=True)]), rotor=True, ground=None, water=False
    )
    speed, spin = _at(1.0, 2.0, -0.5), _at(0.4, -0.3, 0.8)
    state = with_it.still(_at(0, 0, 2), _at(1, 0, 0, 0), speed, spin, np.zeros((6, 1)))
    after = entered(with_it, without, state, ZERO)
    m = without.motion(after, ZERO)[0]
    assert m.velocity == pytest.approx(speed)
    assert m.spin == pytest.approx(spin)
    assert after[9, 0] != pytest.approx(state[9, 0], rel=1e-3)


@pytest.mark.parametrize("family", sorted(MAKERS))
def test_the_folder_of_a_robot_adds_up_to_its_vehicle(family: str) -> None:
    """Mass, centre and inertia of all links of the URDF are those that are simulated."""
    robot = _case(family).robot
    v = robot.vehicle
    links = ElementTree.fromstring(folder.urdf(robot))
    joints = {j.find("child").get("link"): j for j in links.iter("joint")}  # type: ignore[union-attr]
    parts = []
    for link in links.iter("link"):
        node = link.find("inertial")
        assert node is not None
        joint = joints.get(link.get("name"))
        moves = joint is not None and joint.get("type") != "fixed"
        if moves or not _numbers(node, "mass", "value")[0]:
            continue
        place = _numbers(node, "origin", "xyz")
        if joint is not None:
            place = place + _numbers(joint, "origin", "xyz")
        words = ("ixx", "ixy", "ixz", "ixy", "iyy", "iyz", "ixz", "iyz", "izz")
        own = node.find("inertia")
        assert own is not None
        tensor = np.array([float(own.get(w, "0")) for w in words]).reshape(3, 3)
        parts.append((_numbers(node, "mass", "value")[0], place, tensor))
    mass = sum(p[0] for p in parts)
    centre = sum((p[0] * p[1] for p in parts), np.zeros(3)) / mass
    tensor = sum((p[2] + folder.steiner(p[0], p[1] - centre) for p in parts), np.zeros((3, 3)))
    tree = robot.tree
    assert mass == pytest.approx(v.mass if tree is None else tree.base_mass, rel=1e-6)
    assert centre == pytest.approx(v.centre if tree is None else tree.base_centre, abs=1e-7)
    wanted = v.inertia if tree is None else tree.base_inertia
    assert np.diag(tensor) == pytest.approx(wanted, rel=1e-5)
    least = np.linalg.eigvalsh(parts[0][2])
    assert least[0] > 0.0
    assert least[0] + least[1] >= least[2] * (1.0 - 1e-6)


def _numbers(node: ElementTree.Element, name: str, key: str) -> Array:
    found = node.find(name)
    assert found is not None
    return np.array([float(x) for x in found.get(key, "").split()])


def test_the_stated_wave_is_the_simulated_one_in_the_time_of_the_log() -> None:
    """The surface that a log's meta.yaml states at t is the simulated one at its row."""
    case = next(c for c in (_case("buoy", seed=s) for s in range(20)) if c.robot.waves)
    log = case.logs[1]
    stated = records.meta(case, log, 4)["baseline"][0]["parameters"]
    plant = stack([case.at(case.nominal, log, None)])
    plant["ripple"] = np.zeros((5, 3, 1))
    row, x, y = 250, 0.7, -0.4
    simulated = surroundings.elevation(plant, _at(x), _at(y), np.array([(row + 4) * 0.01]))[0, 0]
    rate = 2.0 * np.pi / stated["period"]
    k = rate**2 / GRAVITY
    t = log.origin + row * 0.01
    along = x * np.cos(stated["direction"]) + y * np.sin(stated["direction"])
    a = stated["amplitude"]
    angle = k * along - rate * t + stated["phase"]
    crest = 0.5 * k * a**2 * np.cos(2 * angle)
    assert simulated == pytest.approx(a * np.cos(angle) + crest, abs=1e-5)


def test_asked_numbers_are_wrong_in_the_folder_and_right_in_the_truth() -> None:
    """A calibration's folder differs from the simulated plant by what its truth says."""
    case = _case("boat", "calibrate", seed=5)
    said = folder.content(case.stated)
    for name, entry in case.truth["calibration"].items():
        _, instance, key = name.split(".")
        assert said["effects"][instance][key] == pytest.approx(entry["stated"])
        assert abs(entry["stated"] / entry["value"] - 1.0) > 0.1
