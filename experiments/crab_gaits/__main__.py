"""``python -m seals.experiments.crab_gaits``."""

import sys

from seals.experiments.crab_gaits import main
from seals.experiments.ending import ended

sys.exit(ended(main))
