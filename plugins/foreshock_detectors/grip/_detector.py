"""The grip detector: one Gripper per configured gripper."""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.detector import Inputs
from foreshock.records import Indication
from foreshock_detectors.grip._config import GripConfig
from foreshock_detectors.grip._gripper import Gripper

__all__ = ["GripDetector"]


class GripDetector:
    """Implements foreshock.detector.Detector.

    Until the sampling period is known, and while the last sample of any gripper is malformed, nothing is said of any:
    all kinds are then unobserved. The mass is left out for all while one gripper's cannot be judged.
    """

    def __init__(self, config: GripConfig) -> None:
        self._config = config
        self.reset(0)

    def reset(self, seed: int) -> None:  # noqa: ARG002  # nothing here is random
        """Forget everything."""
        self._grippers = tuple((name, Gripper(subject, self._config)) for name, subject in self._config.names)

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:  # noqa: ARG002  # time is the samples' own
        """Three indications per gripper."""
        new = inputs.new
        observed = weighed = True
        for name, gripper in self._grippers:
            for sample in new.get(name, ()):
                gripper.push(sample)
            observed = observed and gripper.observed
            weighed = weighed and gripper.mass_observed
        if not observed:
            return ()
        found = [indication for _, gripper in self._grippers for indication in gripper.indications()]
        return found if weighed else [i for i in found if i.kind != "mass-misestimation"]
