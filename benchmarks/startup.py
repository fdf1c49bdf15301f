"""Start-up time of commands in fresh processes: ``python benchmarks/startup.py``."""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time

import machine

CLI = "from seals.cli.main import main; main()"
CASES = {
    "python -c pass": ["-c", "pass"],
    "import seals": ["-c", "import seals"],
    "seals list": ["-c", CLI, "list"],
    "seals run experiment=drop_test": ["-c", CLI, "run", "experiment=drop_test"],
}


def seconds(arguments: list[str], folder: str) -> float:
    """Return the time of one fresh process [s]; a failure is an error."""
    begin = time.perf_counter()
    subprocess.run([sys.executable, *arguments], check=True, cwd=folder, capture_output=True)
    return time.perf_counter() - begin


def main() -> None:
    """Print first, median, lowest and highest time of each case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--repeats", type=int, default=5, help="processes of each case after the first"
    )
    repeats = parser.parse_args().repeats
    print(machine.describe())
    print(f"{'fresh process':34} {'first [s]':>9} {'median [s]':>10} {'lowest':>7} {'highest':>8}")
    with tempfile.TemporaryDirectory() as folder:
        for name, arguments in CASES.items():
            first = seconds(arguments, folder)
            found = machine.median(lambda a=arguments: seconds(a, folder), repeats)
            print(f"{name:34} {first:9.2f} {found[0]:10.2f} {found[1]:7.2f} {found[2]:8.2f}")


if __name__ == "__main__":
    machine.one_thread()
    main()
