"""Small ways in which a file, a stream or a name of strangers held up or broke a command."""

from __future__ import annotations

import io
import json
import os
import signal
import socket
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest

from seals.cli.main import main
from seals.config.overrides import refuse_dangerous
from seals.errors import ConfigError
from seals.run.replay_config import recalled
from seals.scaffold.writing import beside_of
from seals.terminal import PlainStream

pytestmark = pytest.mark.usefixtures("elsewhere")


def command(words: list[str], **more: object) -> subprocess.CompletedProcess[str]:
    """Run the command in a process of its own."""
    code = "import sys; from seals.cli.main import main; sys.exit(main())"
    line = [sys.executable, "-c", code, *words]
    return subprocess.run(line, capture_output=True, text=True, timeout=120, check=False, **more)  # type: ignore[call-overload,no-any-return]


def test_terminals_of_few_signs_show_marks() -> None:
    """What ASCII does not have is no reason to end."""
    raw = io.BytesIO()
    stream = PlainStream(io.TextIOWrapper(raw, encoding="ascii"))
    stream.write("5 kg m² a\n")
    stream.flush()
    assert raw.getvalue() == b"5 kg m? a\n"


def test_ascii_and_closed_streams_do_not_end_a_command() -> None:
    """The exit code is that of the command, and there is no traceback."""
    found = command(
        ["describe", "effect", "added_mass"], env={**os.environ, "PYTHONIOENCODING": "ascii"}
    )
    assert (found.returncode, found.stderr) == (0, "")
    for closed in (">&-", "2>&-", ">&- 2>&-"):
        code = "import sys; from seals.cli.main import main; sys.exit(main(['list', 'wave']))"
        line = f'"{sys.executable}" -c "{code}" {closed}'
        shell = subprocess.run(
            ["sh", "-c", line], stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, check=False
        )
        assert (shell.returncode, shell.stderr) == (0, b""), closed


def test_closed_streams_swallow_what_is_written(monkeypatch: pytest.MonkeyPatch) -> None:
    """Python's own stream is None where the descriptor was closed."""
    for name in ("stdout", "stderr"):
        with monkeypatch.context() as within:
            within.setattr(sys, name, None)
            assert main(["list", "wave"]) == 0
            assert main(["no_such_verb"]) == 2


def test_long_words_of_a_note_are_refused_at_once() -> None:
    """Hydra's parser would take a minute for them."""
    Path("sweep").mkdir()
    note = {"verb": "run", "words": [f"name={'a' * 400_000}"], "started": ""}
    Path("sweep/sweep.json").write_text(json.dumps(note))
    begin = time.monotonic()
    assert main(["run", "resume=sweep"]) == 2
    assert time.monotonic() - begin < 20.0
    with pytest.raises(ConfigError, match="holds words of 40,000 characters"):
        refuse_dangerous(["a=" + "b" * 19_998] * 2, where="a card", remedy="Look.")


def test_a_run_that_was_live_is_repeated_in_silence() -> None:
    """Whom a run talked to is not for its folder to say."""
    pytest.importorskip("foxglove")
    words = ["run", "robot=ball", "time.duration=0.02", "out=one"]
    assert main([*words, "live=foxglove", "live.port=0", "live.speed=0"]) == 0
    assert recalled(Path("one")).live is None
    assert main(["run", "repeat=one", "out=two"]) == 0


def test_nobody_knows_where_a_new_folder_is_prepared() -> None:
    """What lay there before, such as a link to elsewhere, is neither followed nor removed."""
    first, second = beside_of(Path("a"), "b"), beside_of(Path("a"), "b")
    assert first != second
    assert stat.S_ISDIR(first.lstat().st_mode)
    Path("kept").mkdir()
    Path(".mine.part").symlink_to("kept")
    Path("m.urdf").write_text('<robot name="m"><link name="b"/></robot>')
    main(["new", "robot", "mine", "--urdf", "m.urdf"])
    assert Path(".mine.part").is_symlink()
    assert not [*Path().glob(".mine.*.part")]


def test_a_flag_before_a_folder_keeps_it(capsys: pytest.CaptureFixture[str]) -> None:
    """The folder of --config-dir is no run to replay."""
    Path("theirs/experiment").mkdir(parents=True)
    assert main(["view", "--config-dir", "theirs", "experiment=none_such"]) == 2
    assert capsys.readouterr().err.startswith("ConfigError: experiment=none_such does not exist")


@pytest.mark.thorough
def test_a_silent_router_does_not_hold_an_end() -> None:
    """SIGTERM ends a run that called somebody who says nothing."""
    pytest.importorskip("zenoh")
    with socket.create_server(("127.0.0.1", 0)) as server:
        place = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        code = "import sys; from seals.cli.main import main; sys.exit(main())"
        words = ["run", "robot=ball", "live=ros2", f"live.connect=[{place}]", "time.duration=1000"]
        run = subprocess.Popen([sys.executable, "-c", code, *words], stderr=subprocess.PIPE)
        caller, _ = server.accept()
        with caller:
            time.sleep(0.5)
            begin = time.monotonic()
            run.send_signal(signal.SIGTERM)
            said = run.communicate(timeout=60)[1]
        assert time.monotonic() - begin < 7.0
    assert run.returncode == 130
    assert b"Traceback" not in said


def test_a_session_with_a_silent_router_opens_soon() -> None:
    """Whoever was called and says nothing is waited for a second, not ten."""
    pytest.importorskip("zenoh")
    from seals.plugins.live.ros2 import session_of

    with socket.create_server(("127.0.0.1", 0)) as server:
        place = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        begin = time.monotonic()
        session = session_of([place], [], taken=["a"], published=["b"])
        assert time.monotonic() - begin < 7.0
        session.close()
