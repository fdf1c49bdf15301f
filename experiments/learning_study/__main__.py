"""``python -m seals.experiments.learning_study``."""

import sys

from seals.experiments.ending import ended
from seals.experiments.learning_study import main

sys.exit(ended(main))
