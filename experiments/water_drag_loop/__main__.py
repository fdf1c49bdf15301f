"""``python -m seals.experiments.water_drag_loop``."""

import sys

from seals.experiments.ending import ended
from seals.experiments.water_drag_loop import main

sys.exit(ended(main))
