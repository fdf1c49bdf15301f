"""Entry of the ``seals`` command: dispatch to a command, error output, exit code."""

from __future__ import annotations

import contextlib
import importlib
import os
import sys
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import seals
from seals.child_process import protect_children
from seals.cli.installed_files import overwritten_by_other
from seals.cli.of_system import explained
from seals.cli.slips import repeated_keys
from seals.cli.words import with_keys
from seals.errors import (
    ConfigError,
    LogError,
    RobotError,
    SealsError,
    printable,
    refuse_unlisted,
)
from seals.registry import blame
from seals.run.stopping import stoppable
from seals.sound_numbers import arises_inside, numeric_fault
from seals.terminal import plain_streams


@dataclass(frozen=True, kw_only=True)
class Verb:
    """One command of the command line.

    Args:
        summary: one line for the help.
        usage: what follows the verb, and an example.
        target: ``module:function`` taking the arguments and returning the exit code; empty for an
            application that Hydra composes from the root of the verb's name.
        task: module, and facts of such an application, as for `seals.cli.hydra_app.Application`.
        takes: keys of which a value may stand without its key, the likeliest first.
        words: ``module:function`` that returns the words for Hydra.
        more: ``module:function`` that returns further lines of help.
        one_thread: libraries of linear algebra that have one thread: many small matrices are
            faster without others, which get into each other's way.
    """

    summary: str
    usage: str
    target: str = ""
    task: Mapping[str, Any] = field(default_factory=dict)
    takes: tuple[str, ...] = ()
    words: str = ""
    more: str = ""
    one_thread: tuple[str, ...] = ()


VERBS = {
    "run": Verb(
        takes=("experiment", "robot", "repeat"),
        target="seals.cli.hydra_app:run",
        summary="simulate a robot; write a log, plots and a report",
        usage="[EXPERIMENT|ROBOT] [KEY=VALUE ...] [--multirun [--resume]] [--cfg job]\n"
        "  seals run drop_test                  or: experiment=drop_test\n"
        "  seals run robot=path/to/folder water=fossen time.duration=3\n"
        "  seals run experiment=drop_test +effect@effects.second=quadratic_drag\n"
        "  seals run --config-dir FOLDER experiment=NAME       configurations of another folder\n\n"
        "  seals run -m experiment=drop_test 'seed=range(10)' hydra/launcher=joblib     a sweep\n\n"
        "  --trust   with --config-dir: allow its YAML to name classes and settings of Hydra\n"
        "  --resume  with the same arguments: resume a sweep, or resume=FOLDER; see docs/sweeps.md",
    ),
    "compare": Verb(
        takes=("log", "experiment", "robot"),
        task={"module": "seals.compare.application", "run": True},
        summary="compare a model with a measurement",
        usage="LOG [ROBOT] [KEY=VALUE ...]\n"
        "  seals compare log=runs/some_run robot=ball water=fossen",
    ),
    "convert": Verb(
        takes=("log",),
        target="seals.cli.convert:convert",
        summary="convert a log of another program: PX4, MCAP, rosbag2, WitMotion, CSV",
        usage="LOG out=FOLDER [reader=NAME] [map=FILE] [meta=FILE] [KEY=VALUE ...]\n"
        "  seals convert log=flight.ulg out=flight_7\n"
        "  seals convert log=recording out=dive_2 reader.topics=[/imu,/odom]     a rosbag2\n"
        "  seals convert log=tank.csv reader=csv map=tank_map.yaml out=tank_1\n"
        "  seals convert log=flight.ulg robot=my_quad rate=100 out=flight_8    to diagnose\n\n"
        "MCAP and rosbag2 need aam-seals[logs]\n\n"
        "exit code: 0 written, 2 refused",
    ),
    "diagnose": Verb(
        takes=("log", "experiment", "robot"),
        target="seals.cli.hydra_app:diagnose",
        one_thread=("OPENBLAS",),
        summary="name the physical effect that the model of a log is missing",
        usage="LOG [LOG ...] [ROBOT] [out=FOLDER] [KEY=VALUE ...], or EXPERIMENT\n"
        "  seals diagnose log=flight_7 out=answer_7\n"
        "  seals diagnose log=hidden_effect/flight_a     a log that comes with SEALS\n"
        "  seals diagnose experiment=falling_balls       runs of a published measurement\n\n"
        "exit code: 0 nothing missing, 10 named, 11 one of several, 12 none of these,\n"
        "13 cannot tell, 20 bad data",
    ),
    "calibrate": Verb(
        takes=("log", "robot"),
        task={"module": "seals.sysid.calibration.application", "logs": True},
        one_thread=("OPENBLAS",),
        summary="estimate parameters of a robot from its logs, with intervals",
        usage="LOG [LOG ...] [ROBOT] parameters=[NAME,...] [held_out=LOG] [out=FOLDER]\n"
        "  seals calibrate log=[flight_1,flight_2] robot=my_robot parameters=[mass] out=answer\n"
        "  seals calibrate log=flight_1 robot=my_robot parameters=[inertia] apply=true\n\n"
        "  parameters  names as in robot.yaml: mass, inertia, effects.NAME.FIELD,\n"
        "              actuators.NAME.FIELD, hulls.LINK.displaced_volume, sensors.NAME.FIELD;\n"
        "              groups (effects.water_drag) and patterns (actuators.*)\n"
        "exit code: 0 calibrated, 2 refused",
    ),
    "add": Verb(
        takes=("diagnosis",),
        task={"module": "seals.sysid.validation.application", "name": "add", "logs": True},
        one_thread=("OPENBLAS",),
        summary="write the effects that a diagnosis found to a model overlay",
        usage="DIAGNOSIS name=NAME [robot=FOLDER] [base=MODEL] [choose=EFFECT]"
        " [accept=formula]\n"
        "  seals add diagnosis=answer_7 name=my_model        writes models/my_model.yaml\n"
        "  seals run robot=ball +model=my_model\n\n"
        "exit code: 0 written, 2 refused (nothing was named, or the name exists)",
    ),
    "verify": Verb(
        takes=("log", "model", "robot"),
        task={"module": "seals.sysid.validation.application", "name": "verify", "logs": True},
        one_thread=("OPENBLAS",),
        summary="verify a model on a held-out log in the rigid-body simulator",
        usage="LOG MODEL [ROBOT] [older=[FOLDER,...]]\n"
        "  seals verify log=flight_8 model=my_model older=[flight_5,flight_6]\n"
        "exit code: 0 the error fell, 14 it did not fall (the model is marked as withdrawn)",
    ),
    "plan": Verb(
        takes=("diagnosis", "log", "robot"),
        task={"module": "seals.sysid.experiment_design.application", "logs": True},
        words="seals.cli.slips:question",
        one_thread=("OPENBLAS",),
        summary="choose the manoeuvre that best distinguishes effects",
        usage="LOG [ROBOT] effects=[NAME,NAME] [out=FOLDER], or DIAGNOSIS [ROBOT]\n"
        "  seals plan effects=[payload,thrust_coefficient] log=flight_7 out=plan_7\n"
        "  seals plan effects=[quadratic_drag] log=flight_7\n"
        "  seals plan diagnosis=answer_7\n"
        "exit code: 0 planned, 2 refused",
    ),
    "list": Verb(
        target="seals.cli.listing:list_installed",
        summary="list installed plug-ins, robots and configurations",
        usage="[KIND]\n  seals list effect",
    ),
    "describe": Verb(
        target="seals.cli.describe:describe",
        summary="show the parameters, units, bounds and equation of a plug-in",
        usage="KIND NAME, or NAME\n"
        "  seals describe effect quadratic_drag\n"
        "  seals describe drag                     lists the plug-ins with this word in their name",
    ),
    "check": Verb(
        takes=("robot",),
        target="seals.cli.check:check",
        summary="check the physical plausibility of a robot folder",
        usage="ROBOT\n"
        "  seals check robot=aam\n"
        "  seals check robot=path/to/folder\n"
        "exit code: 0 all checks passed, 1 a check failed, 2 the robot cannot be read",
    ),
    "teleop": Verb(
        takes=("script", "experiment", "robot"),
        task={"module": "seals.teleop.application"},
        summary="fly a robot by keyboard, gamepad or a script of keys; record a demonstration",
        usage="[ROBOT|EXPERIMENT|SCRIPT] [device=keyboard|joystick] [KEY=VALUE ...]\n"
        "  seals teleop robot=aam                        a window opens; needs aam-seals[teleop]\n"
        "  seals teleop robot=aam script=keys.yaml       no window, as fast as possible\n"
        "  seals teleop script=runs/some_session/keys.csv    repeats a session\n\n"
        "  script    events such as: - {t: 0.5, hold: w, seconds: 2}   or CSV: t,control,value\n"
        "  guide.speed, guide.climb, guide.turn, guide.joint_speed: values at full deflection",
        more="seals.control.key_events:table",
    ),
    "autopilot": Verb(
        takes=("experiment", "robot"),
        task={"module": "seals.teleop.autopilot.application"},
        words="seals.cli.hydra_app:channelled",
        summary="let ArduPilot or PX4 fly a robot in lockstep; write a log as for any run",
        usage="ROBOT [protocol=ardupilot|px4] [host=HOST] [port=PORT] [KEY=VALUE ...]\n"
        "  seals autopilot robot=crazyflie environment.ground_level=0\n"
        "  seals autopilot robot=auv water=fossen controller=thruster_pulses\n\n"
        "  protocol  ardupilot: sim_vehicle.py -f JSON:127.0.0.1 (UDP 9002), the default;\n"
        "            px4: MAVLink HIL (TCP 4560), needs aam-seals[autopilot]\n"
        "  controller.channel, low, high, reverse   channel and range of each drive and servo\n"
        "Ctrl-C ends the run; seals diagnose log=RUN reads its log",
    ),
    "train": Verb(
        takes=("resume", "learner", "env"),
        target="seals.cli.train:train",
        one_thread=("OPENBLAS",),
        summary="train a policy; write learning curves and the policy",
        usage="[LEARNER] [ENV] [course.steps=50000] [KEY=VALUE ...], or FOLDER to resume\n"
        "  seals train                                           the first policy: hover in wind\n"
        "  seals train learner=sac env=reach                     batch dynamics on the CPU\n"
        "  seals train learner=sacfd demonstrations=runs/some_recording/demonstrations\n"
        "  seals train learner=sac device=cuda count=4096 learner.batch=8192 learner.ratio=0.01\n"
        "  seals train resume=runs/some_training                 resume an interrupted one\n\n"
        "  writes training.csv, evaluation.csv, policy/ and run.json; needs aam-seals[learn]\n\n"
        "exit code: 0 done, 2 refused, 130 interrupted (a checkpoint was written)",
    ),
    "evaluate": Verb(
        takes=("policy", "env"),
        target="seals.cli.evaluate:evaluate",
        one_thread=("OPENBLAS", "OMP"),
        summary="evaluate a policy from held-out starts, or compare training runs",
        usage="POLICY|scripted|random|still [ENV] [KEY=VALUE ...],\n"
        "   or: seals evaluate --compare ARM=FOLDERS ...\n"
        "  seals evaluate policy=runs/some_training/policy       100 held-out starts\n"
        "  seals evaluate policy=FOLDER grid=robustness          a table over world variants\n"
        "  seals evaluate --compare sac='runs/study/sac/*' sacfd='runs/study/sacfd/*'\n"
        "  seals evaluate --compare runs/study                   runs/study/ARM/SEED\n\n"
        "  budget, reference, value, hold   analysis plan: declare it before the runs",
    ),
    "record": Verb(
        takes=("policy", "env"),
        target="seals.cli.evaluate:record",
        one_thread=("OPENBLAS", "OMP"),
        summary="record the episodes of a policy as demonstrations for learning",
        usage="[ENV] [POLICY|scripted|KEYS.yaml] [episodes=10] [KEY=VALUE ...]\n"
        "  seals record env=reach out=demos/reach                ten successful episodes\n"
        "  seals record env=reach noise=0.1 hdf5=reach.hdf5      action noise; one file\n"
        "  seals record policy=runs/some_session/keys.csv who=human keep=all\n\n",
    ),
    "export": Verb(
        takes=("policy",),
        task={"module": "seals.learn.export", "folder": False},
        summary="export a policy as an ONNX file, for programs without PyTorch",
        usage="POLICY [format=onnx] [out=policy.onnx] [replace=true]\n"
        "  seals export policy=runs/some_training/policy out=reach.onnx\n"
        "  seals export policy=crab/walk out=walk.onnx\n\n"
        "  The file normalises observations itself and is compared with the policy before it is\n"
        "  written; needs aam-seals[learn,export]\n\n"
        "exit code: 0 written, 2 refused",
    ),
    "view": Verb(
        takes=("run", "experiment", "robot"),
        task={"module": "seals.view.application"},
        words="seals.cli.hydra_app:viewed",
        summary="show a run in the browser: replay a folder, or start a live run",
        usage="RUN, or [EXPERIMENT|ROBOT] [KEY=VALUE ...] [sliders=[KEY,KEY:LOW:HIGH]]\n"
        "      [host=HOST] [port=PORT]\n"
        "  seals view runs/2026-11-21/14-03-22_drop_test\n"
        "  seals view experiment=drop_test sliders=[initial.position.2:0.2:2]\n\n"
        "  host      0.0.0.0 opens the page to other machines; the default is this machine only\n"
        "  port      0 takes any free port; over SSH: ssh -L 8080:localhost:8080 MACHINE\n"
        "needs aam-seals[view]; Ctrl-C ends it",
    ),
    "render": Verb(
        takes=("run",),
        task={"module": "seals.view.films.application"},
        words="seals.cli.hydra_app:rendered",
        summary="render the frames of a run and a film of them",
        usage="RUN [renderer=tiny|mitsuba] [quality=draft|paper] [camera=...] [KEY=VALUE]\n"
        "  seals render run=runs/some_run                    frames and film.mp4 in its folder\n"
        "  seals render run=runs/some_run renderer=mitsuba camera=split water_type=coastal_3\n"
        "  seals render run=runs/some_run 'camera=[2,-1,0.5]' 'look_at=[0,0,0]' speed=0.5\n\n"
        "The same command resumes an interrupted render; complete frames are kept.\n"
        "mitsuba and the film need aam-seals[render]",
    ),
    "new": Verb(
        target="seals.cli.new:new",
        summary="create a robot folder from a URDF, or a package for a plug-in",
        usage="robot NAME urdf=FILE [package=NAME=FOLDER] [density=KG_PER_M3]\n"
        "      [medium=air|water|both] [missing-meshes=boxes] [forward=-x]\n"
        "      [arg=NAME=VALUE],\n"
        "   or: seals new datasheet LOG ROBOT\n"
        "   or: seals new hydrodynamics ROBOT [method=bem|ellipsoid] [replace=true]\n"
        "   or: seals new effect|sensor|controller|guide|task NAME\n"
        "  seals new robot my_hexa urdf=downloads/hexa.urdf\n"
        "  seals new robot my_arm urdf=arm.urdf package=arm_description=../arm_description\n"
        "  seals new effect whirl\n\n"
        "  robot     creates the folder NAME with robot.yaml, the URDF and its meshes\n"
        "  package   folder of package://NAME/..., model://NAME and $(find NAME)\n"
        "  urdf      a URDF, xacro, SDF or MJCF file\n"
        "  density   [kg/m^3] gives links without <inertial> the mass of their shapes\n"
        "  medium    medium of operation: includes rotors under water, drag in air, or both\n"
        "  missing-meshes=boxes  replaces missing meshes by boxes with the inertia of the links\n"
        "  arg       the value of an argument of a xacro file\n"
        "  forward   axis of the base link that points forward: x, -x, y or -y\n"
        "  datasheet writes datasheet.yaml into the robot's folder: noise, tolerances, delays\n"
        "  hydrodynamics writes added mass and radiation of a hull into robot.yaml: link=NAME,\n"
        "            panels=500, density=KG_PER_M3; method=bem needs aam-seals[hydro]\n"
        "  effect    creates the package seals-NAME with a law, its test and its pyproject.toml\n"
        "exit code: 0 created, 2 refused (the name is taken, the URDF or a mesh cannot be used)",
    ),
    "validate": Verb(
        target="seals.cli.validate:validate",
        summary="run the validation of the particle water; write a report",
        usage="water [CASE ...] [full=true] [out=FOLDER] [device=cuda]\n"
        "  seals validate water\n  seals validate water hydrostatics standing_wave full=true\n\n"
        "exit code: 0 all errors within their limits, 1 an error exceeds its limit, 2 refused",
    ),
    "benchmark": Verb(
        target="seals.experiments.naming_benchmark.command:benchmark",
        summary="score SEALS, other methods and your own on public logs with a hidden effect",
        usage="[out=FOLDER] [logs=[NAMES]] [mujoco=PYTHON]\n  seals benchmark out=scored",
    ),
    "runs": Verb(
        takes=("folder",),
        task={"module": "seals.sweep.application"},
        words="seals.sweep.settings:quoted",
        summary="list, filter and compare run folders; table and picture of a sweep",
        usage="FOLDER [where=CONDITIONS] [metric=NAMES] [table=FILE] [plot=FILE against=KEY]\n"
        "  seals runs runs/2026-11-21/14-03-22_drop_test          state, duration, overrides\n"
        "  seals runs runs where='state=done, seed<5' sort=-seconds\n"
        "  seals runs SWEEP metric=position_z.min,steps_per_second table=sweep.parquet\n"
        "  seals runs SWEEP metric=position_z.min against=initial.position.2 plot=depth.png\n\n"
        "  where     KEY=VALUE (with * and ?), !=, <, <=, >, >=; all of them must hold\n"
        "  metric    key of run.json; COLUMN.STATISTIC of the log; TABLE.COLUMN.STATISTIC;\n"
        "            statistics: first last min max mean rms std range\n"
        "exit code: 0 listed, 2 refused",
    ),
    "completion": Verb(
        target="seals.cli.completion:completion",
        summary="print the shell completion for verbs, groups and options",
        usage="bash|zsh|fish\n"
        '  eval "$(seals completion bash)"                       in ~/.bashrc\n'
        '  eval "$(seals completion zsh)"                        in ~/.zshrc, after compinit\n'
        "  seals completion fish > ~/.config/fish/completions/seals.fish\n\n"
        "Names of plug-ins, robots and recipes are those installed at the time of printing.",
    ),
    "doctor": Verb(
        target="seals.cli.doctor:doctor",
        summary="check the installation and its plug-ins",
        usage="[full=true]\n  seals doctor\n\n"
        "  full   true: also compose every robot and experiment of this package",
    ),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    Args:
        arguments: the words after ``seals``; those of the process when left out.

    Returns:
        0 when done, 1 when a check found faults, 2 when refused, 130 when interrupted.
    """
    protect_children(arguments)
    words = list(sys.argv[1:] if arguments is None else arguments)
    with plain_streams():
        return _ended(words, ours=arguments is None)


def _ended(words: list[str], *, ours: bool) -> int:
    """Run a command; return how it ended."""
    try:
        # a caller in Python keeps its handlers
        with stoppable() if ours else contextlib.nullcontext():
            return _dispatch(words)
    except KeyboardInterrupt:
        print("Interrupted.", file=sys.stderr)
        return 130
    except BrokenPipeError:
        return left_by_reader()
    except SealsError as refusal:
        return _refused(explained(refusal) or refusal, words)
    except Exception as fault:
        # what arises in a plug-in is told as its fault, all else is one of this program
        named = explained(fault) or (None if isinstance(fault, OSError) else blame(fault))
        if named is None:
            # numbers that are allowed each by itself, and together cannot be computed with
            why = numeric_fault(fault)
            if why is None or not arises_inside(fault):
                raise
            named = ConfigError(
                f"the given numbers lead to a system that cannot be solved: {why}.\n"
                "Look for an extreme value or for zeros: masses, gravity, gains, steps, lengths of "
                "logs. SEALS_DEBUG=1 shows where it occurred."
            )
        return _refused(named, words)


def left_by_reader() -> int:
    """Return the exit code where the reader of a pipe, such as head, has left.

    There is nothing to say, and nothing is left to flush at exit.
    """
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0


def _refused(refusal: SealsError, words: Sequence[str]) -> int:
    if os.environ.get("SEALS_DEBUG") == "1":
        traceback.print_exc()
    verb = next((word for word in words[:1] if word in VERBS), "")
    print(two_lines(refusal, verb), file=sys.stderr)
    return refusal.exit_code


_NEXT: Mapping[type[SealsError], str] = {
    LogError: "Give a complete file of a kind that is read: seals list reader.",
    RobotError: "Give a complete URDF, xacro, SDF or MJCF file, or a folder with robot.yaml.",
}
"""What to do next where an error says only what is wrong, by its class."""


def two_lines(refusal: SealsError, verb: str = "") -> str:
    r"""Format an error in exactly two lines: what is wrong, and what to do.

    Args:
        refusal: whose first line says what is wrong, and the others what to do.
        verb: that was refused; empty for none.

    Example:
        >>> print(two_lines(SealsError("a is wrong.\nAllowed: b")))
        SealsError: a is wrong.
        Allowed: b
    """
    lines = [line.strip() for line in str(refusal).splitlines() if line.strip()] or ["refused."]
    usage = f"See: seals help {verb}" if verb else "See: seals --help"
    advice = " ".join(lines[1:]) or _NEXT.get(type(refusal), usage)
    # a message quotes what a stranger wrote
    return f"{type(refusal).__name__}: {printable(lines[0])}\n{printable(advice)}"


def _dispatch(words: list[str]) -> int:
    if words[:1] == ["help"] and words[1:]:
        words = [*words[1:], "--help"]
    if not words or words[0] in ("-h", "--help", "help"):
        print(_overview())
        return 0
    if words[0] in ("-V", "--version") or "--version" in words[1:]:
        print(f"seals {seals.__version__}")
        return 0
    name, rest = words[0], words[1:]
    if name.startswith("-"):
        refuse_unlisted(name, ("--help", "--version"), f"there is no flag '{name}'")
    refuse_unlisted(name, VERBS, f"there is no verb '{name}'", label="Verbs", most=len(VERBS))
    if "--help" in rest or "-h" in rest:
        print(_help(name, VERBS[name]))
        return 0
    verb = VERBS[name]
    if "--compare" not in rest:
        rest = with_keys(name, verb.takes, rest)
    remark = overwritten_by_other()
    if remark:
        print(f"note: {remark}", file=sys.stderr)
    for library in verb.one_thread:
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    if verb.target:
        code: int = _named(verb.target)(rest)
    else:
        from seals.cli.hydra_app import Application, launch

        words = _named(verb.words)(rest) if verb.words else rest
        code = launch(name, words, Application(**verb.task))
    for remark in repeated_keys(rest):
        print(remark, file=sys.stderr)
    return code


def _named(target: str) -> Any:
    """Return the object that ``module:function`` names."""
    module, _, function = target.partition(":")
    return getattr(importlib.import_module(module), function)


def _help(name: str, verb: Verb) -> str:
    """Return usage and examples of a verb, and its keys."""
    from seals.cli.options import help_of
    from seals.config import roots

    parts = [f"seals {name}: {verb.summary}", f"usage: seals {name} {verb.usage.rstrip()}"]
    if verb.takes:
        given = ", ".join(f"{key}=" for key in verb.takes)
        which = "the first matching key: " if len(verb.takes) > 1 else ""
        parts.append(f"A value without a key is assigned to {which}{given}")
    if name in roots.VERBS:
        parts.append(f"keys, each as KEY=VALUE:\n{help_of(name)}")
    return "\n\n".join([*parts, *([_named(verb.more)()] if verb.more else [])])


def _overview() -> str:
    rows = "\n".join(f"  {name:11}{verb.summary}" for name, verb in VERBS.items())
    return (
        f"SEALS {seals.__version__}: robots that cross sea, air and land\n\n"
        f"usage: seals VERB [arguments]\n\n{rows}\n\n"
        "  to find missing effects: diagnose a log, plan if ambiguous, add, verify on a new log\n"
        "  seals help VERB shows usage, examples and keys; SEALS_DEBUG=1 shows tracebacks"
    )
