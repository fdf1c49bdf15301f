"""``python -m seals.experiments.hover_arm``."""

import sys

from seals.experiments.ending import ended
from seals.experiments.hover_arm import main

sys.exit(ended(main))
