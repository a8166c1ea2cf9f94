"""The proximity detector behind the real supervisor, and no heavy import before it is built."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence

from test_proximity_detector import Scene

from foreshock.records import Sample
from foreshock.testing import DetectorConformance
from foreshock_detectors import proximity


class TestProximityConformance(DetectorConformance):
    spec = proximity.SPEC
    config = proximity.ProximityConfig()

    def recording(self) -> Sequence[Sample]:
        """A person walks up to the standing robot at 1.4 m/s, seen at 20 Hz with 20 mm of noise and no velocity."""
        return Scene(human=lambda t: (7.5 - 1.4 * max(0.0, t - 1.0), 0.4), noise_m=0.02, measured=False).samples(4.5)


def test_importing_the_plugin_loads_nothing_heavy():
    heavy = ("pinocchio", "fcl", "coal", "scipy", "filterpy")
    code = f"import sys, foreshock_detectors.proximity; print([m for m in {heavy!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
