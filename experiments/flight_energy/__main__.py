"""``python -m seals.experiments.flight_energy``."""

import sys

from seals.experiments.flight_energy import main

sys.exit(main())
