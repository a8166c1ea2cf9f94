"""For the tests of plugin authors: an inheritable conformance class, a rig, faults, and fakes of the ports.

Nothing here needs pytest to be imported.
"""

from foreshock.testing.conformance import DetectorConformance
from foreshock.testing.fakes import PendulumTwin, ThresholdConfig, ThresholdDetector, threshold_spec
from foreshock.testing.faults import disordered, duplicated, not_a_number, silenced, spoiled
from foreshock.testing.rig import Call, Play, Rig
from foreshock.testing.spec_checks import Check, spec_checks

__all__ = [
    "Call",
    "Check",
    "DetectorConformance",
    "PendulumTwin",
    "Play",
    "Rig",
    "ThresholdConfig",
    "ThresholdDetector",
    "disordered",
    "duplicated",
    "not_a_number",
    "silenced",
    "spec_checks",
    "spoiled",
    "threshold_spec",
]
