"""``python -m seals.experiments.oval_crossing``."""

import sys

from seals.experiments.oval_crossing import main

sys.exit(main())
