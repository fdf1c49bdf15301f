"""``python -m seals.experiments.drop_test``."""

import sys

from seals.experiments.drop_test import main
from seals.experiments.ending import ended

sys.exit(ended(main))
