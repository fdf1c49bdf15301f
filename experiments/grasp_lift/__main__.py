"""``python -m seals.experiments.grasp_lift``."""

import sys

from seals.experiments.ending import ended
from seals.experiments.grasp_lift import main

sys.exit(ended(main))
