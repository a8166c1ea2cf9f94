"""The swing-leg detector: one indication per foot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

from foreshock.detector import Inputs
from foreshock.messages import MotionPlan, Odometry
from foreshock.records import Indication, SampleRef
from foreshock_detectors._sequential import severity
from foreshock_detectors._stamped import fresh
from foreshock_detectors.swing_leg._config import SwingLegConfig
from foreshock_detectors.swing_leg._foot import Foot

__all__ = ["SwingLegDetector"]

WORST = 3.0
"""A deviation of so many thresholds is as bad as can be told: all that a human foot needs is used up (ISO 13854)."""


class SwingLegDetector:
    """Implements foreshock.detector.Detector.

    A foot that the plan stands on does not drift; whether it slips, others tell.
    """

    def __init__(self, config: SwingLegConfig) -> None:
        self._config = config
        self.reset(0)

    def reset(self, seed: int) -> None:  # noqa: ARG002  # nothing here is random
        """Forget everything."""
        self._feet = {name: Foot(self._config) for name in self._config.feet}

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:  # noqa: ARG002  # samples carry their stamps
        """An indication per foot; none of a foot whose plan and motion have not met yet."""
        motion = inputs.latest.get("plan")
        if motion is None:
            return ()
        support = cast(MotionPlan, motion.value).support
        limit, said = self._config.drift_m, []
        for name, foot in self._feet.items():
            if name not in inputs.latest or f"{name}-plan" not in inputs.latest:
                continue
            for sample in fresh(inputs, f"{name}-plan"):
                foot.planned(cast(Odometry, sample.value), sample.stamp_ns)
            for sample in fresh(inputs, name):
                foot.measured(cast(Odometry, sample.value), sample.stamp_ns, name in support)
            if foot.stamp_ns < 0:
                continue
            own, plan = inputs.latest[name], inputs.latest[f"{name}-plan"]
            evidence = (SampleRef(own.channel, own.stamp_ns), SampleRef(plan.channel, plan.stamp_ns))
            worst = severity(foot.deviation_m, limit, WORST * limit) if foot.present else 0.0
            said.append(
                Indication(
                    "swing-leg-drift",
                    name,
                    own.stamp_ns,
                    foot.present,
                    foot.deviation_m,
                    limit,
                    "m",
                    worst,
                    evidence,
                    None,
                    {"now_m": foot.now_m},
                )
            )
        return said
