"""``python -m seals.experiments.grasp_lift``."""

import sys

from seals.experiments.grasp_lift import main

sys.exit(main())
