"""Program that simulates a live run in a child process.

python live_child.py FOLDER DESCRIPTOR
"""

import os
import sys

# no file beside this one stands for a module of the standard library
if sys.path and sys.path[0] == os.path.dirname(__file__):
    del sys.path[0]


def main(folder: str, descriptor: str) -> int:
    """Simulate the run in a folder, send frames through a pipe; return the exit code."""
    from multiprocessing.connection import Connection

    from seals.view.live import simulate_into

    simulate_into(folder, Connection(int(descriptor), readable=False))
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
