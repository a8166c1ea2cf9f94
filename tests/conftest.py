"""Shared by all tests: where the rogue plugins lie, and how hypothesis runs."""

from __future__ import annotations

import sys
from pathlib import Path

from hypothesis import HealthCheck, settings

ROGUES = Path(__file__).parent / "rogues" / "detectors"
if str(ROGUES) not in sys.path:  # child processes import the rogues by name
    sys.path.insert(0, str(ROGUES))

# no deadline: the machine is shared; no database: a failure must not depend on what ran before
settings.register_profile(
    "foreshock", deadline=None, database=None, print_blob=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("foreshock")
