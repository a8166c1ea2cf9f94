"""The actuators detector: pairs measured and commanded joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

from foreshock.detector import Inputs
from foreshock.messages import JointState
from foreshock.records import Indication, SampleRef
from foreshock_detectors.actuators._config import ActuatorsConfig
from foreshock_detectors.actuators._joint import Joint

__all__ = ["ActuatorsDetector"]


class ActuatorsDetector:
    """Implements foreshock.detector.Detector.

    A configured joint that is missing from the state or the command leaves both kinds unobserved; a message without
    efforts leaves torque-saturation unobserved.
    """

    def __init__(self, config: ActuatorsConfig) -> None:
        self._config = config
        self.reset(0)

    def reset(self, seed: int) -> None:  # noqa: ARG002  # nothing here is random
        """Forget everything."""
        self._joints = tuple(Joint(name, peak, self._config) for name, peak in self._config.joints.items())

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:  # noqa: ARG002  # time is the samples' own
        """Two indications per joint."""
        config, sample, order = self._config, inputs.latest["joints"], inputs.latest["command"]
        state, command = cast(JointState, sample.value), cast(JointState, order.value)
        if len(state.position) != len(state.name) or len(command.position) != len(command.name):
            return ()
        try:
            pairs = [(joint, state.name.index(joint.name), command.name.index(joint.name)) for joint in self._joints]
        except ValueError:
            return ()
        stamp_ns = sample.stamp_ns
        seen = (SampleRef(sample.channel, stamp_ns), SampleRef(order.channel, order.stamp_ns))
        found = [joint.drift(config, command.position[c], state.position[s], stamp_ns, seen) for joint, s, c in pairs]
        if len(state.effort) == len(state.name) and len(command.effort) == len(command.name):
            found += [
                joint.saturation(config, command.effort[c], state.effort[s], stamp_ns, seen) for joint, s, c in pairs
            ]
        return found
