"""``python -m seals.experiments.open_sea``."""

import sys

from seals.experiments.ending import ended
from seals.experiments.open_sea import main

sys.exit(ended(main))
