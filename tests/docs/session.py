"""A reader at work: an empty folder, a shell, and an environment of its own to install into."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

from tests.docs.pages import Block, Step, told

LONGEST = 3600.0
"""Seconds after which a command counts as hanging [s]."""
_PROGRAMS = {
    "seals": "from seals.cli.main import main; raise SystemExit(main())",
    "pytest": "from pytest import main; raise SystemExit(main())",
    "pip": "from pip._internal.cli.main import main; raise SystemExit(main())",
}


class Session:
    """Follows the blocks of one page, in order, in one folder.

    What a page installs goes into an environment of its own, which sees the packages of the
    running interpreter and is left behind with the folder.

    Args:
        folder: empty folder to work in; the environment is made beside it.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.environment = folder.parent / f"{folder.name}_environment"
        venv.create(self.environment, with_pip=False, symlinks=True)
        self._see_installed()

    def follow(self, block: Block) -> None:
        """Run or save one block; its commands must end and print as promised."""
        if block.file:
            path = self.folder / block.file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block.text, encoding="utf-8")
        elif block.language == "python":
            self.run(Step(f"python - <<'END_OF_BLOCK'\n{block.text}END_OF_BLOCK", [], 0))
        for step in block.steps:
            self.run(step)

    def run(self, step: Step) -> None:
        """Run one command in the shell; it must end and print as promised."""
        done = subprocess.run(
            ["bash", "-c", step.command],
            cwd=self.folder,
            env=self._surroundings(),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
            timeout=LONGEST,
        )
        printed = done.stdout + done.stderr
        assert done.returncode == step.code, f"{step.command}\n[{done.returncode}] {printed}"
        assert [line for line in step.lines if not told(line, printed)] == [], printed

    def _surroundings(self) -> dict[str, str]:
        return {
            **os.environ,
            "PATH": f"{self.environment / 'bin'}:{os.environ['PATH']}",
            # packages are built with what is installed: nothing is fetched
            "PIP_NO_BUILD_ISOLATION": "0",
            "PIP_NO_INDEX": "1",
            "PIP_DISABLE_PIP_VERSION_CHECK": "1",
            "OPENBLAS_NUM_THREADS": "1",
        }

    def _see_installed(self) -> None:
        """Let the environment see what is installed here, and have the programs of it."""
        major, minor = sys.version_info[:2]
        site = self.environment / "lib" / f"python{major}.{minor}" / "site-packages"
        there = sysconfig.get_paths()["purelib"]
        (site / "installed.pth").write_text(f"import site; site.addsitedir({there!r})\n")
        for name, program in _PROGRAMS.items():
            path = self.environment / "bin" / name
            path.write_text(f"#!{self.environment}/bin/python\n{program}\n", encoding="utf-8")
            path.chmod(0o755)
