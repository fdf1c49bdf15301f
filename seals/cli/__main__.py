"""The command line, as ``python -m seals.cli`` and for the processes that the program starts."""

import os
import sys

# run as a file, this folder would come before the standard library
if sys.path and sys.path[0] == os.path.dirname(__file__):
    del sys.path[0]

if __name__ == "__main__":
    from seals.cli.main import main

    sys.exit(main())
