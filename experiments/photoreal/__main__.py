"""``python -m seals.experiments.photoreal``."""

import sys

from seals.experiments.ending import ended
from seals.experiments.photoreal import main

sys.exit(ended(main))
