"""``python -m seals.experiments.hover_arm``."""

import sys

from seals.experiments.hover_arm import main

sys.exit(main())
