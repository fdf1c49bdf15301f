"""``python -m seals.experiments.five_seeds``."""

import sys

from seals.experiments.ending import ended
from seals.experiments.five_seeds import main

sys.exit(ended(main))
