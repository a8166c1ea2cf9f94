"""The load detector: one wrist, one object."""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.detector import Inputs
from foreshock.messages import Imu, Odometry
from foreshock.records import Indication, SampleRef
from foreshock_detectors._sequential import severity
from foreshock_detectors._stamped import Stamped
from foreshock_detectors.load._config import LoadConfig
from foreshock_detectors.load._tilt import Tilt
from foreshock_detectors.load._wrist import Wrist

__all__ = ["LoadDetector"]


class LoadDetector:
    """Implements foreshock.detector.Detector. A kind whose sampling period is not known yet is left out."""

    def __init__(self, config: LoadConfig) -> None:
        self._config = config
        self.reset(0)

    def reset(self, seed: int) -> None:  # noqa: ARG002  # nothing here is random
        """Forget everything."""
        self._wrist, self._tilt, self._commands = Wrist(self._config), Tilt(self._config), Stamped()

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:  # noqa: ARG002  # the samples' own time
        """Wrist instability and tilt drift now."""
        latest, new, config = inputs.latest, inputs.new, self._config
        wrist, tilt = self._wrist, self._tilt
        for sample in new.get("command", ()):
            self._commands.push(sample)
        for sample in new.get("imu", ()):
            command = self._commands.at(sample.stamp_ns)
            if isinstance(sample.value, Imu) and isinstance(command, Odometry):
                wrist.push(sample.stamp_ns, sample.value.angular_velocity, command.angular)
        for sample in new.get("object", ()):
            command = self._commands.at(sample.stamp_ns)
            if isinstance(sample.value, Odometry) and isinstance(command, Odometry):
                tilt.push(sample.stamp_ns, sample.value, command)
        found = []
        if wrist.ready:
            sample = latest["imu"]
            present, limit = wrist.present, wrist.limit
            full = max(config.wrist_full_rad_s, 2.0 * limit)
            found.append(
                Indication(
                    "wrist-instability", config.gripper, sample.stamp_ns, present, wrist.rms, limit, "rad/s",
                    severity(wrist.rms, limit, full) if present else 0.0, (SampleRef(sample.channel, sample.stamp_ns),),
                )
            )  # fmt: skip
        if tilt.ready:
            sample = latest["object"]
            allowance = config.tilt_allowance_rad
            found.append(
                Indication(
                    "tilt-drift", config.gripper, sample.stamp_ns, tilt.present, tilt.statistic, 1.0, "1",
                    severity(tilt.angle, allowance, config.tilt_full_rad) if tilt.present else 0.0,
                    (SampleRef(sample.channel, sample.stamp_ns),), None, {"tilt_rad": tilt.angle},
                )
            )  # fmt: skip
        return found
