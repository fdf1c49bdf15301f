"""Entry of ``python -m seals.cli``."""

import os
import sys

# run as a file, this folder would come before the standard library
if sys.path and sys.path[0] == os.path.dirname(__file__):
    del sys.path[0]

if __name__ == "__main__":
    from seals.cli.main import main

    sys.exit(main())
