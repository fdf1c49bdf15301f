"""``python -m seals.experiments.wave_impact``."""

import sys

from seals.experiments.ending import ended
from seals.experiments.wave_impact import main

sys.exit(ended(main))
