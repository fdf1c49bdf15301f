"""``python -m seals.experiments.soak``."""

import sys

from seals.experiments.ending import ended
from seals.experiments.soak import main

sys.exit(ended(main))
