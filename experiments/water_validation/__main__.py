"""``python -m seals.experiments.water_validation``."""

import sys

from seals.experiments.ending import ended
from seals.experiments.water_validation import main

sys.exit(ended(main))
