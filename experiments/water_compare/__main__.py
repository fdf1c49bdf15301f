"""``python -m seals.experiments.water_compare``."""

import sys

from seals.experiments.ending import ended
from seals.experiments.water_compare import main

sys.exit(ended(main))
