"""For the tests of plugin authors: fakes of the ports, and an inheritable conformance class."""

from foreshock.testing.fakes import PendulumTwin, ThresholdConfig, ThresholdDetector, threshold_spec

__all__ = ["PendulumTwin", "ThresholdConfig", "ThresholdDetector", "threshold_spec"]
