"""``python -m seals.experiments.oval_crossing``."""

import sys

from seals.experiments.ending import ended
from seals.experiments.oval_crossing import main

sys.exit(ended(main))
