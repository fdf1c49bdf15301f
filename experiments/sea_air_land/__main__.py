"""``python -m seals.experiments.sea_air_land``."""

import sys

from seals.experiments.ending import ended
from seals.experiments.sea_air_land import main

sys.exit(ended(main))
