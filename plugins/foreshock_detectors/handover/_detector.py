"""The handover detector: the time that the plan has against the time that the partner takes."""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.detector import Inputs
from foreshock.messages import Humans, TaskPhase, WrenchStamped
from foreshock.records import Indication, SampleRef
from foreshock_detectors._sequential import Hysteresis, severity
from foreshock_detectors.handover._config import HandoverConfig
from foreshock_detectors.handover._partner import Partner

__all__ = ["HandoverDetector"]


class HandoverDetector:
    """Implements foreshock.detector.Detector.

    The planned time t_p is stamp + due_s of the last plan that waited for the partner; the observed one t_o is the
    onset of the pull. The statistic is, while they are unmatched, in s:

    - t_p - t_o while the partner pulls and is not due yet,
    - t - t_p while the partner is due and neither pulls nor has a hand at the object,
    - t_o - t_p while the partner pulls and the robot has given up,

    and 0 otherwise: once the plan and the partner agree, the mismatch is over, however long the pull lasts.
    """

    def __init__(self, config: HandoverConfig) -> None:
        self._config = config
        self.reset(0)

    def reset(self, seed: int) -> None:  # noqa: ARG002  # nothing here is random
        """Forget everything."""
        config = self._config
        threshold = config.threshold_s
        self._partner = Partner(config)
        self._mismatched = Hysteresis(threshold, 0.5 * threshold, round(config.hold_s * 1e9))
        self._planned_ns = -1
        self._largest_s = 0.0

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:  # noqa: ARG002  # time is the samples' own
        """One indication."""
        partner, config = self._partner, self._config
        for sample in inputs.new.get("wrench", ()):
            if isinstance(sample.value, WrenchStamped):
                partner.feel(sample.stamp_ns, sample.value)
        for sample in inputs.new.get("humans", ())[-1:]:
            if isinstance(sample.value, Humans):
                partner.see(sample.value)
        plan, wrench, humans = (inputs.latest.get(name) for name in ("plan", "wrench", "humans"))
        if plan is None or wrench is None or humans is None or not isinstance(plan.value, TaskPhase):
            return ()
        stamp = max(plan.stamp_ns, wrench.stamp_ns, humans.stamp_ns)
        difference = self._difference_s(plan.stamp_ns, plan.value, stamp)
        present = self._mismatched.push(difference, stamp)
        self._largest_s = max(self._largest_s, difference) if present else 0.0
        threshold = config.threshold_s
        return (
            Indication(
                "timing-mismatch", config.subject, stamp, present, difference, threshold, "s",
                severity(self._largest_s, threshold, config.full_s) if present else 0.0,
                tuple(SampleRef(s.channel, s.stamp_ns) for s in (plan, wrench, humans)), None,
                {"pull_n": partner.pull_n, "arrived": float(partner.arrived), "phase": float(plan.value.phase)},
            ),
        )  # fmt: skip

    def _difference_s(self, plan_ns: int, plan: TaskPhase, now_ns: int) -> float:
        """|observed - planned| while they do not match (s)."""
        config, partner = self._config, self._partner
        pulled_ns = partner.pulled_ns
        if plan.phase in config.before:
            self._planned_ns = plan_ns + round(plan.due_s * 1e9)
            return max(0.0, (self._planned_ns - pulled_ns) / 1e9) if pulled_ns >= 0 else 0.0
        if plan.phase in config.during:
            self._planned_ns = plan_ns + round(plan.due_s * 1e9)
            waited = pulled_ns < 0 and not partner.arrived
            return max(0.0, (now_ns - self._planned_ns) / 1e9) if waited else 0.0
        if plan.phase in config.given_up and pulled_ns >= 0 and self._planned_ns >= 0:
            return max(0.0, (pulled_ns - self._planned_ns) / 1e9)
        return 0.0
