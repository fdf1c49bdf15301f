"""Completion in the shell, ``--version`` behind every verb, and plug-ins that fail by name."""

from __future__ import annotations

import contextlib
import functools
import io
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

import seals
from seals.cli.completion import SHELLS, words_of_verbs
from seals.cli.main import VERBS, main
from seals.errors import ConfigError
from seals.plugins.effects.quadratic_drag import DragQuadratic
from seals.registry import blame
from seals.schema import read

ASK = """
{script}
COMP_LINE='{line}'; COMP_POINT=${{#COMP_LINE}}
read -r -a COMP_WORDS <<< "$COMP_LINE"; [[ "$COMP_LINE" == *' ' ]] && COMP_WORDS+=('')
COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1))
compopt() {{ :; }}
_seals
printf '%s\\n' "${{COMPREPLY[@]}}"
"""


@functools.cache
def script(shell: str) -> str:
    """Return what is printed for a shell."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        assert main(["completion", shell]) == 0
    return said.getvalue()


def replies(line: str, kind: str = "") -> str:
    """Return what bash offers behind a line."""
    asked = kind + ASK.format(script=script("bash"), line=line)
    done = subprocess.run(["bash", "-c", asked], capture_output=True, text=True, check=True)
    return done.stdout


@pytest.mark.skipif(shutil.which("bash") is None, reason="bash is not installed")
@pytest.mark.parametrize(
    ("line", "there", "gone"),
    [
        ("seals dia", "diagnose", "run"),
        ("seals ", "--version", "robot=ball"),
        ("seals run robot=cr", "crab", "ball"),
        ("seals run time.dur", "time.duration=", "time.step="),
        ("seals describe quad", "quadratic_drag", "linear_drag"),
        ("seals new ", "medium=", "run"),
        ("seals train learner=s", "sac", "robot"),
        ("seals completion ", "fish", "run"),
    ],
)
def test_bash_completes(line: str, there: str, gone: str) -> None:
    """What may come next is offered, what the shell knows of a word already is left out."""
    found = replies(line).split()
    assert there in found
    assert gone not in found


@pytest.mark.skipif(shutil.which("bash") is None, reason="bash is not installed")
@pytest.mark.parametrize(
    ("line", "shown"),
    [
        ("seals run time.", "time.step=  (1e-05 to 0.1 s, default 0.004)"),
        ("seals render qual", "quality=paper"),
        ("seals run initial.dr", "initial.drives=carrying"),
        ("seals render f", "fov=  (0.05 to 2.5 rad, default 0.9)"),
    ],
)
def test_bash_lists_units_and_choices(line: str, shown: str) -> None:
    """What is only listed says unit, bounds and default; a choice is a word for each name."""
    found = replies(line, "COMP_TYPE=63\n")
    assert any(shown.endswith(said) and said for said in found.splitlines()), found


@pytest.mark.parametrize("shell", SHELLS)
def test_every_verb_is_completed(shell: str) -> None:
    """Each script holds every verb and names of plug-ins; the shell can read it."""
    text = script(shell)
    assert all(verb in text for verb in VERBS)
    assert "robot=ball" in text
    if shutil.which(shell) is not None:
        subprocess.run([shell, "-n"], input=text, text=True, check=True, capture_output=True)


def test_other_shells_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    """A shell that is not known is refused in two lines with the nearest."""
    assert main(["completion", "bsh"]) == 2
    err = capsys.readouterr().err
    assert "Did you mean 'bash'?" in err
    assert len(err.splitlines()) == 2


@pytest.mark.parametrize("verb", list(VERBS))
def test_every_verb_tells_the_version(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    """``seals VERB --version`` is that of the program."""
    assert main([verb, "--version"]) == 0
    assert capsys.readouterr().out == f"seals {seals.__version__}\n"


def test_words_are_there_once() -> None:
    """No verb offers a word twice."""
    assert all(len(row) == len(set(row)) for row in words_of_verbs().values())


def test_a_failing_plug_in_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What an effect raises in a run names it, its class and the line, in two lines."""
    text = "def loads(*given):\n    return {}['rudder']\n"
    space: dict[str, Any] = {"__name__": DragQuadratic.__module__}
    exec(compile(text, "strange.py", "exec"), space)
    monkeypatch.setattr(DragQuadratic, "loads", staticmethod(space["loads"]))
    monkeypatch.chdir(tmp_path)
    words = ["robot=ball", "water=fossen", "initial.position=[0,0,-1]", "time.duration=0.01"]
    assert main(["run", *words]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    (said,) = [line for line in lines if line.startswith("BrokenPlugin")]
    assert "effect 'quadratic_drag' (seals.plugins.effects.quadratic_drag:DragQuadratic)" in said
    assert "KeyError: 'rudder' (strange.py, line 2)" in said
    assert "Traceback" not in "\n".join(lines)


def test_a_fault_elsewhere_blames_nobody() -> None:
    """An error in none of the plug-ins keeps its traceback."""
    with pytest.raises(ZeroDivisionError) as caught:
        _ = 1 // (len("") * 2)
    assert blame(caught.value) is None


@pytest.mark.parametrize(
    ("hint", "given", "wanted"),
    [
        (list[list[float]], [[0, 1], [2.5]], [[0.0, 1.0], [2.5]]),
        (list[list[list[float]]], [[[1], [2]]], [[[1.0], [2.0]]]),
        (dict[str, list[float]], {"a": [1, 2]}, {"a": [1.0, 2.0]}),
        (list[list[float]] | None, [[3]], [[3.0]]),
        (list[list[float]] | None, None, None),
        (list[str], ["1"], ["1"]),
    ],
)
def test_whole_numbers_in_nested_lists(hint: Any, given: Any, wanted: Any) -> None:
    """However deep, whole numbers are numbers; nothing else becomes one."""
    found = read(hint, given, where="effects.x.y")
    assert repr(found) == repr(wanted)
    with pytest.raises(ConfigError, match=r"effects\.x\.y\[0\]\[1\]=True is not allowed"):
        read(list[list[float]], [[1, True]], where="effects.x.y")
