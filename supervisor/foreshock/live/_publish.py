"""Decisions for whoever watches: foreshock_msgs/Decision, some times a second and whenever a level changes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from foreshock.records import Decision, Intervention
from foreshock.wire import encode_ros, ros_header, ros_type

__all__ = ["decision_bytes"]


def decision_bytes(d: Decision, epoch: int, digest: str, health: Mapping[str, str]) -> bytes:
    """A decision as CDR; its stamp is on the supervisor's timeline.

    Args:
        d: to publish.
        epoch: of the supervisor.
        digest: of all decisions up to this one.
        health: state and reason of whatever is not ok, by source; the decision's own lists changes only.
    """
    modes = sorted(d.levels)
    precursor, intervention = ros_type("foreshock_msgs/msg/Precursor"), ros_type("foreshock_msgs/msg/Intervention")
    message = ros_type("foreshock_msgs/msg/Decision")(
        header=ros_header(d.now_ns),
        epoch=epoch,
        tick=d.tick,
        level=int(d.level),
        motion_permitted=d.motion_permitted,
        probability=d.risk.probability,
        lower=d.risk.lower,
        upper=d.risk.upper,
        m=d.risk.m,
        q=d.risk.q,
        trust=d.trust.trust,
        control_trust=d.trust.control_trust,
        coverage=d.trust.coverage,
        time_to_event_s=math.nan if d.time_to_event_s is None else d.time_to_event_s,
        modes=modes,
        probability_by_mode=np.array([d.risk.by_mode.get(m, math.nan) for m in modes]),
        trust_by_mode=np.array([d.trust.control_by_mode.get(m, math.nan) for m in modes]),
        level_by_mode=np.array([int(d.levels[m]) for m in modes], np.uint8),
        unobserved=list(d.trust.unobserved),
        health=[f"{source}: {said}" for source, said in sorted(health.items())],
        precursors=[
            precursor(
                kind=p.kind,
                subject=p.subject,
                phase=p.phase,
                severity=p.severity,
                occurrences=p.occurrences,
                onset_ns=p.onset_ns,
                detector=p.detector,
                frozen=p.frozen,
                statistic=p.statistic,
                threshold=p.threshold,
                unit=p.unit,
            )
            for p in d.precursors
        ],
        interventions=[_intervention(intervention, i, epoch) for i in d.interventions],
        digest=digest,
    )
    return encode_ros("foreshock_msgs/msg/Decision", message)


def _intervention(cls: Any, i: Intervention, epoch: int) -> Any:
    return cls(
        header=ros_header(i.stamp_ns),
        epoch=epoch,
        number=0,
        action=i.action,
        strength=i.strength,
        mode=i.mode,
        reasons=list(i.reasons),
    )
