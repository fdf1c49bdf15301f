"""``python -m seals.experiments.drop_test``."""

import sys

from seals.experiments.drop_test import main

sys.exit(main())
