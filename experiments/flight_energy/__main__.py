"""``python -m seals.experiments.flight_energy``."""

import sys

from seals.experiments.ending import ended
from seals.experiments.flight_energy import main

sys.exit(ended(main))
