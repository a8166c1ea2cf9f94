"""The tool detector: one tool, its tip, its orientation, its hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from foreshock.detector import Inputs
from foreshock.messages import Humans, Odometry, WrenchStamped
from foreshock.records import Indication, Sample, SampleRef
from foreshock_detectors._sequential import Hysteresis, severity
from foreshock_detectors._stamped import Stamped
from foreshock_detectors.tool._config import ToolConfig
from foreshock_detectors.tool._orientation import unsafe
from foreshock_detectors.tool._stability import Stability
from foreshock_detectors.tool._tip import Tip

__all__ = ["ToolDetector"]


class ToolDetector:
    """Implements foreshock.detector.Detector. A kind is left out while its inputs are missing or too new."""

    def __init__(self, config: ToolConfig) -> None:
        self._config = config
        self.reset(0)

    def reset(self, seed: int) -> None:  # noqa: ARG002  # nothing here is random
        """Forget everything."""
        self._tip, self._commands = Tip(self._config), Stamped()
        self._orientation = Hysteresis(1.0, 0.7, round(self._config.hold_s * 1e9))
        self._stability: Stability | None = None

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:  # noqa: ARG002  # the samples' own time
        """What is known now of the three kinds."""
        latest, config, tip = inputs.latest, self._config, self._tip
        for sample in inputs.new.get("command", ()):
            self._commands.push(sample)
        for sample in inputs.new.get("pose", ()):
            command = self._commands.at(sample.stamp_ns)
            if isinstance(sample.value, Odometry) and isinstance(command, Odometry):
                tip.push(sample.stamp_ns, sample.value, command)
        seen = latest["pose"]
        command = self._commands.at(seen.stamp_ns)
        if not isinstance(seen.value, Odometry) or not isinstance(command, Odometry):
            return ()
        found: list[Indication] = []
        if tip.dt > 0.0:
            full = max(config.tip_full_m, 2.0 * tip.limit)
            found.append(
                Indication(
                    "tool-tip-oscillation", config.tool, seen.stamp_ns, tip.present, tip.rms, tip.limit, "m",
                    severity(tip.rms, tip.limit, full) if tip.present else 0.0, _refs(seen),
                )
            )  # fmt: skip
        people = latest.get("humans")
        if people is not None and isinstance(people.value, Humans):
            judged = unsafe(config, seen.value, command, people.value.humans)
            if judged is not None:
                found.append(self._judge(judged, seen, people))
        self._weigh(latest, found)
        return found

    def _judge(self, judged: tuple[float, dict[str, float]], seen: Sample, people: Sample) -> Indication:
        statistic, measures = judged
        present = self._orientation.push(statistic, seen.stamp_ns)
        return Indication(
            "unsafe-orientation", self._config.tool, seen.stamp_ns, present, statistic, 1.0, "1",
            severity(statistic, 1.0, 3.0) if present else 0.0, _refs(seen, people), None, measures,
        )  # fmt: skip

    def _weigh(self, latest: Mapping[str, Sample], found: list[Indication]) -> None:
        measured, expected, config = latest.get("wrench"), latest.get("expected"), self._config
        if measured is None or expected is None or not self._tip.dt > 0.0:
            self._stability = None if measured is None or expected is None else self._stability
            return
        if not isinstance(measured.value, WrenchStamped) or not isinstance(expected.value, WrenchStamped):
            return
        if self._stability is None:
            self._stability = Stability(config, self._tip.dt)
        test = self._stability
        test.push(measured.stamp_ns, measured.value.torque, expected.value.torque)
        if test.ready:
            found.append(
                Indication(
                    "loss-of-tool-stability", config.tool, measured.stamp_ns, test.present, test.statistic, 1.0, "1",
                    severity(test.statistic, 1.0, config.nis_full) if test.present else 0.0, _refs(measured, expected),
                )
            )  # fmt: skip


def _refs(*samples: Sample) -> tuple[SampleRef, ...]:
    return tuple(SampleRef(s.channel, s.stamp_ns) for s in samples)
