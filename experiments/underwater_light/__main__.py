"""``python -m seals.experiments.underwater_light``."""

import sys

from seals.experiments.ending import ended
from seals.experiments.underwater_light import main

sys.exit(ended(main))
