"""Joint servos: the law they follow, at any stiffness, in both engines."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.errors import ConfigError, PhysicsError
from seals.motion import Inputs
from seals.plugins.actuators.servos import Servos
from seals.plugins.backends.mujoco import BackendMujoco
from seals.plugins.backends.pybullet import BackendPybullet
from seals.run import build_twin, build_world

if TYPE_CHECKING:
    from seals.robot.settings import RobotSettings
    from seals.run.settings import RunSettings
    from tests.verification.conftest import Bench

Floats = NDArray[np.float64]
INERTIA, COMMAND = 2e-3, 0.5
JOINT = (
    '<joint name="{name}" type="continuous"><parent link="{parent}"/><child link="{child}"/>'
    '<origin xyz="{at}"/><axis xyz="0 1 0"/></joint>'
)


def lever(bench: Bench, inertia: float = INERTIA) -> RobotSettings:
    """Return a lever that turns about its centre of mass on a fixed pivot."""
    arm = bench.link("arm", 0.1, (inertia,) * 3)
    joint = JOINT.format(name="pivot", parent="base", child="arm", at="0 0 0")
    return bench.robot(bench.link("base", 1.0, (1.0,) * 3), arm, joint, fixed_base=True)


def hand(bench: Bench) -> RobotSettings:
    """Return a free body of 1 kg with an arm of 0.2 kg and a finger of 10 g."""
    return bench.robot(
        bench.link("base", 1.0, (0.01, 0.012, 0.015)),
        bench.link("arm", 0.2, (3e-4, 3e-4, 4e-5), centre=(0, 0, -0.06)),
        bench.link("finger", 0.01, (1.5e-6, 1.5e-6, 2e-7), centre=(0, 0, -0.02)),
        JOINT.format(name="shoulder", parent="base", child="arm", at="0.02 0 -0.06"),
        JOINT.format(name="knuckle", parent="arm", child="finger", at="0 0 -0.13"),
    )


def follow(
    engine: str,
    settings: RunSettings,
    command: list[float],
    *,
    implicit: bool = True,
    rise: float = 0.0,
) -> tuple[Floats, Floats]:
    """Return joint positions and rates over a run under a command that rises within ``rise`` s."""
    asked = np.array([command])

    def at(time: float) -> Floats:
        return asked * (0.5 - 0.5 * np.cos(np.pi * min(time / rise, 1.0))) if rise else asked

    step, count = settings.time.step, round(settings.time.duration / settings.time.step)
    if engine == "twin":
        twin, state = build_twin(settings)
        states = [state]
        for k in range(count):
            inputs = Inputs(step, twin.no_torque(), joint_command=at(k * step))
            states.append(twin.advance(states[-1], k * step, step, (inputs,) * 3)[0])
        return np.array([s.joints[0] for s in states]), np.array(
            [s.joint_velocity[0] for s in states]
        )
    with contextlib.closing(build_world(settings)) as world:
        actor = world.actors["robot"]
        if not implicit:
            actor.servos.implicit = actor.evaluator.implicit = False
        rows = [actor.body.read()]
        for _ in range(count):
            actor.joint_command = at(world.time)
            world.step()
            rows.append(actor.body.read())
        return np.array([r.joints for r in rows]), np.array([r.joint_velocity for r in rows])


def error(bench: Bench, engine: str, servo: Servos, step: float, pole: float) -> float:
    """Return the largest error of a lever's swing against the closed form, by its travel."""
    settings = bench.settings(
        lever(bench), {"servos": servo}, weight=False, step=step, duration=0.2
    )
    q, _ = follow(engine, settings, [COMMAND])
    t = step * np.arange(len(q))
    # critically damped, I q'' + kd q' + kp (q - c) = 0: q = c (1 - (1 + p t) exp(-p t))
    exact = COMMAND * (1.0 - (1.0 + pole * t) * np.exp(-pole * t))
    return float(np.abs(q[:, 0] - exact).max() / COMMAND)


@pytest.mark.parametrize("engine", ["world", "twin"])
def test_the_step_converges_to_the_law_as_written(bench: Bench, engine: str) -> None:
    """F = Kd (Vd - V) + Ks (Pd - P) on one joint is the closed form, to second order."""
    pole = 60.0
    servo = Servos(kp=INERTIA * pole**2, kd=2.0 * INERTIA * pole, torque_limit=1e3)
    coarse, fine = (error(bench, engine, servo, h, pole) for h in (1e-3, 2.5e-4))
    print(f"{engine}: error of the swing {coarse:.1e} at 1 ms, {fine:.1e} at 0.25 ms")
    # a scheme of second order errs by about (p h)^2
    assert fine < (pole * 2.5e-4) ** 2
    assert coarse > 12.0 * fine


def test_the_torque_at_work_is_that_of_the_formula(bench: Bench) -> None:
    """At 0.25 ms the acceleration of a stiff joint is (Kd (Vd - V) + Ks (Pd - P)) / I."""
    servo = Servos(kp=30.0, kd=0.3, torque_limit=1e3)
    step = 2.5e-4
    settings = bench.settings(
        lever(bench), {"servos": servo}, weight=False, step=step, duration=0.1
    )
    q, v = follow("world", settings, [COMMAND])
    law = (30.0 * (COMMAND - q) - 0.3 * v) / INERTIA
    felt = (v[2:] - v[:-2]) / (2.0 * step)
    # central differences err by h^2 q''' / 6: with rates up to kd/I + sqrt(kp/I) = 270 1/s, 1e-3
    assert np.abs(felt - law[1:-1])[2:].max() < 3e-3 * np.abs(law).max()


@pytest.mark.parametrize("engine", ["world", "twin"])
@pytest.mark.parametrize(("kp", "kd"), [(2.0, 0.02), (2.0, 0.05), (0.1, 0.001)])
def test_a_finger_of_ten_grams_holds_still_at_four_milliseconds(
    bench: Bench, engine: str, kp: float, kd: float
) -> None:
    """Gains that no explicit step of 4 ms survives bring the finger to its command."""
    servo = Servos(kp_each=[20.0, kp], kd_each=[1.0, kd], torque_limit_each=[4.0, 0.3])
    settings = bench.settings(hand(bench), {"servos": servo}, weight=False, duration=2.0)
    q, v = follow(engine, settings, [0.4, -0.6])
    assert np.abs(q[-1] - [0.4, -0.6]).max() < 2e-3
    assert np.abs(v[-1]).max() < 2e-2
    assert np.abs(q).max() < 1.0


def test_the_same_finger_does_not_survive_an_explicit_servo(bench: Bench) -> None:
    """Taken explicitly, the same gains run away: the implicit step is needed."""
    servo = Servos(kp_each=[20.0, 2.0], kd_each=[1.0, 0.05], torque_limit_each=[4.0, 0.3])
    settings = bench.settings(hand(bench), {"servos": servo}, weight=False, duration=0.5)
    with pytest.raises(PhysicsError, match="moves at"):
        follow("world", settings, [0.4, -0.6], implicit=False)


def test_a_stiff_finger_moves_alike_in_both_engines(bench: Bench) -> None:
    """World and twin at 4 ms agree within 2 % of the travel, at 1 ms within 0.5 %."""
    servo = Servos(kp_each=[20.0, 2.0], kd_each=[1.0, 0.02], torque_limit_each=[4.0, 0.3])
    for step, bound in ((4e-3, 2e-2), (1e-3, 5e-3)):
        settings = bench.settings(
            hand(bench), {"servos": servo}, weight=False, step=step, duration=1.0
        )
        tracks = [
            follow(engine, settings, [0.4, -0.6], rise=0.4)[0] for engine in ("world", "twin")
        ]
        apart = float(np.abs(tracks[0] - tracks[1]).max() / 0.6)
        print(f"{step * 1e3:g} ms: {apart:.1e} of the travel")
        assert apart < bound


def test_a_servo_at_its_limit_pushes_with_the_limit(bench: Bench) -> None:
    """A far command accelerates a lever by torque_limit / I until the servo can brake it."""
    servo = Servos(kp=50.0, kd=0.5, torque_limit=0.2)
    settings = bench.settings(lever(bench), {"servos": servo}, weight=False, duration=0.12)
    _, v = follow("world", settings, [3.0])
    t = 0.004 * np.arange(len(v))
    assert np.allclose(v[:, 0], 0.2 / INERTIA * t, rtol=1e-6, atol=1e-9)


def test_a_servo_sags_under_a_load_as_its_stiffness_says(bench: Bench) -> None:
    """A level arm of 0.2 kg at 0.1 m comes to rest m g l / kp below its command."""
    arm = bench.link("arm", 0.2, (1e-4,) * 3, centre=(0.1, 0, 0))
    joint = JOINT.format(name="pivot", parent="base", child="arm", at="0 0 0")
    robot = bench.robot(bench.link("base", 1.0, (1.0,) * 3), arm, joint, fixed_base=True)
    servo = Servos(kp=10.0, kd=0.5)
    q, _ = follow("world", bench.settings(robot, {"servos": servo}, duration=3.0), [0.0])
    rest = 0.2 * 9.81 * 0.1 * np.cos(q[-1, 0]) / 10.0
    assert q[-1, 0] == pytest.approx(rest, rel=1e-6)


@pytest.mark.parametrize("engine", ["world", "twin"])
def test_the_inertia_of_motor_and_gear_slows_a_joint(bench: Bench, engine: str) -> None:
    """A drive of twice the lever's inertia is a lever of three times the inertia."""
    pole, whole = 40.0, 3.0 * INERTIA
    servo = Servos(
        kp=whole * pole**2, kd=2 * whole * pole, torque_limit=1e3, armature=2.0 * INERTIA
    )
    assert error(bench, engine, servo, 1e-3, pole) < 2.0 * (pole * 1e-3) ** 2


def test_a_gripped_object_feels_the_force_of_the_servo(bench: Bench) -> None:
    """A stiff finger against a stop presses with kp (command - q) / lever, not with a share."""
    finger = bench.link(
        "arm", 0.01, (1.5e-6,) * 3, centre=(0.02, 0, 0), collision='<sphere radius="0.05"/>'
    )
    joint = JOINT.format(name="pivot", parent="base", child="arm", at="0 0 0.0499")
    robot = bench.robot(bench.link("base", 1.0, (1.0,) * 3), finger, joint, fixed_base=True)
    robot_file = robot.urdf_path
    text = robot_file.read_text(encoding="utf-8")
    # the ball sits at the finger's end and rolls onto the ground as the finger turns down
    text = text.replace("<collision>", '<collision><origin xyz="0.1 0 0"/>')
    robot_file.write_text(text, encoding="utf-8")
    servo = Servos(kp=2.0, kd=0.02, torque_limit=1.0)
    place: dict[str, Any] = {"environment": {"ground_level": 0.0, "friction": 0.0}}
    settings = bench.settings(robot, {"servos": servo}, weight=False, duration=1.5, **place)
    with contextlib.closing(build_world(settings)) as world:
        actor = world.actors["robot"]
        actor.joint_command = np.array([[0.2]])
        for _ in range(round(settings.time.duration / settings.time.step)):
            world.step()
        wrench, q = actor.body.contact_wrenches()[1], float(actor.body.joint_positions()[0])
    lifted = wrench[0] * -np.sin(q) + wrench[2] * np.cos(q)
    assert lifted * 0.1 * np.cos(q) == pytest.approx(2.0 * (0.2 - q), rel=0.02)


def test_gains_beyond_the_step_are_refused_with_their_bound(bench: Bench) -> None:
    """The refusal names the joint, its inertia, the bound and a step that would do."""
    servo = Servos(kp=50.0, kd=5.0)
    settings = bench.settings(hand(bench), {"servos": servo})
    with pytest.raises(ConfigError, match=r"(?s)'knuckle', whose inertia is .*Allowed") as found:
        build_world(settings)
    assert "time.step=" in str(found.value)
    longest = float(str(found.value).rpartition("time.step=")[2].split()[0])
    build_world(bench.settings(hand(bench), {"servos": servo}, step=0.99 * longest)).close()
    with pytest.raises(ConfigError, match="too stiff"):
        build_world(bench.settings(hand(bench), {"servos": servo}, step=1.05 * longest))


def test_a_snapshot_holds_what_the_servos_know(bench: Bench) -> None:
    """Restored in mid-motion, a stiff hand takes the same way again, bit for bit."""
    servo = Servos(kp_each=[20.0, 2.0], kd_each=[1.0, 0.02], speed_limit=[3.0], armature=1e-6)
    with contextlib.closing(
        build_world(bench.settings(hand(bench), {"servos": servo}, weight=False))
    ) as world:
        actor = world.actors["robot"]
        actor.joint_command = np.array([[0.4, -0.6]])
        for _ in range(20):
            world.step()
        kept, ways = world.snapshot(), []
        for _ in range(2):
            for _ in range(30):
                world.step()
            ways.append(np.concatenate(actor.body.read()))
            world.restore(kept)
    assert np.array_equal(*ways)
    assert abs(ways[0][13]) > 0.05


@pytest.mark.parametrize("engine", [BackendPybullet, BackendMujoco])
@pytest.mark.parametrize("step", [0.002, 0.01])
def test_a_stop_takes_back_what_a_joint_passed_it_by(
    bench: Bench, engine: Any, step: float
) -> None:
    """A pendulum at 7 rad/s passes its stop by one step's way and lies at it half a second later.

    Released level at speed w, it reaches the stop at b with w^2 + 2 m g l sin(b) / I, I about the
    hinge: no faster way into the stop is possible.
    """
    stop, mass, lever_arm, speed = 0.5, 0.5, 0.1, 3.0
    joint = JOINT.format(name="hinge", parent="base", child="arm", at="0 0 0").replace(
        'type="continuous"', 'type="revolute"'
    )
    joint = joint.replace(
        "</joint>", f'<limit lower="{-stop}" upper="{stop}" effort="9" velocity="99"/></joint>'
    )
    robot = bench.robot(
        bench.link("base", 1.0, [0.01] * 3),
        bench.link("arm", mass, [0.001, 0.004, 0.004], centre=(lever_arm, 0, 0)),
        joint,
        fixed_base=True,
    )
    settings = bench.settings(robot, None, joint_velocity=[speed], step=step, duration=1.0)
    settings.backend = engine()
    with contextlib.closing(build_world(settings)) as world:
        rows = []
        for _ in range(round(1.0 / step)):
            world.step()
            rows.append(float(world.actors["robot"].body.read().joints[0]))
    top = np.sqrt(speed**2 + 2 * mass * 9.81 * lever_arm * np.sin(stop) / 0.009)
    assert 0.0 < max(rows) - stop < top * step
    late = np.array(rows[round(0.6 / step) :])
    assert np.abs(late - stop).max() < 1e-3
