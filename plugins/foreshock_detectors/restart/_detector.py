"""The restart detector: one motion against its command and its plan."""

from __future__ import annotations

import math
from collections.abc import Sequence

from foreshock.detector import Inputs
from foreshock.messages import JointState, MotionCommand, Odometry, TaskPhase
from foreshock.records import Indication, Sample, SampleRef
from foreshock_detectors.restart._command import Commands
from foreshock_detectors.restart._config import RestartConfig
from foreshock_detectors.restart._held import Held
from foreshock_detectors.restart._motion import Motion
from foreshock_detectors.restart._timing import Timing

__all__ = ["RestartDetector"]


class RestartDetector:
    """Implements foreshock.detector.Detector.

    Nothing is said before motion and command have been seen, nor while the joint is missing from its channel; nothing
    of timing without the plan's phase.
    """

    def __init__(self, config: RestartConfig) -> None:
        self._config = config
        self.reset(0)

    def reset(self, seed: int) -> None:  # noqa: ARG002  # nothing here is random
        """Forget everything."""
        c = self._config
        hold_ns = round(c.hold_s * 1e9)
        self._motion, self._commands, self._timing = Motion(c), Commands(c), Timing(c)
        self._abrupt = Held("abrupt-motion-onset", "m/s2", c.abrupt_m_s2, 3.0 * c.abrupt_m_s2, hold_ns)
        self._unexpected = Held("unexpected-restart", "m/s", c.start_m_s, 10.0 * c.start_m_s, hold_ns)
        self._late = Held("delayed-stop", "s", c.stopping_s, 4.0 * c.stopping_s, hold_ns)
        self._overshoot = Held("restart-overshoot", "m/s", c.overshoot_m_s, 10.0 * c.overshoot_m_s, hold_ns)
        self._mismatch = Held("timing-mismatch", "s", c.mismatch_s, 5.0 * c.mismatch_s, hold_ns)
        self._measured = False
        self._channel = self._command_channel = self._phase_channel = ""
        self._unasked = False
        self._stop_ns, self._stopped = -1, True
        self._over_before = 0.0

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:  # noqa: ARG002  # time is the samples' own
        """Five indications, four without the plan's phase."""
        for sample in _fresh(inputs, "command", self._commands.stamp_ns):
            if isinstance(sample.value, MotionCommand):
                self._command_channel = sample.channel
                self._commands.push(sample.stamp_ns, sample.value)
        for sample in _fresh(inputs, "phase", self._timing.stamp_ns):
            if isinstance(sample.value, TaskPhase):
                self._phase_channel = sample.channel
                self._timing.push(sample.stamp_ns, sample.value)
        for sample in _fresh(inputs, "motion", self._motion.stamp_ns):
            speed = self._speed(sample.value)
            self._measured = speed == speed
            if self._measured and sample.stamp_ns > self._motion.stamp_ns:
                self._channel = sample.channel
                self._motion.push(sample.stamp_ns, speed)
                self._judge()
        if not self._measured or self._commands.stamp_ns < 0:
            return ()
        stamp, subject = self._motion.stamp_ns, self._config.subject
        seen = (SampleRef(self._channel, stamp), SampleRef(self._command_channel, self._commands.stamp_ns))
        found = [
            h.indication(subject, stamp, seen) for h in (self._abrupt, self._unexpected, self._late, self._overshoot)
        ]
        if "phase" in inputs.latest:
            planned = (seen[0], SampleRef(self._phase_channel, self._timing.stamp_ns))
            found.append(self._mismatch.indication(subject, stamp, planned))
        return found

    def _speed(self, value: object) -> float:
        """Magnitude of the speed (m/s), NaN if it is not measured."""
        if isinstance(value, Odometry):
            return math.hypot(*value.linear)
        if isinstance(value, JointState) and self._config.joint in value.name:
            i = value.name.index(self._config.joint)
            if i < len(value.velocity):
                return abs(value.velocity[i]) * self._config.lever_m
        return math.nan

    def _judge(self) -> None:
        """All five kinds at the newest sample."""
        c, motion = self._config, self._motion
        now_ns, speed = motion.stamp_ns, motion.speed
        asked, most, rise = self._commands.before(now_ns)
        since_s = (now_ns - motion.start_ns) * 1e-9 if motion.start_ns >= 0 and not motion.resting else math.inf

        beyond = motion.acceleration - rise if since_s <= c.onset_s else 0.0
        self._abrupt.push(beyond, now_ns, beyond >= c.abrupt_m_s2)

        if motion.started:
            self._unasked = not asked
        elif motion.resting:
            self._unasked = False
        self._unexpected.push(speed if self._unasked else 0.0, now_ns, self._unasked)

        late = self._late_s(now_ns)
        self._late.push(late, now_ns, late > c.stopping_s)

        margin = max(c.overshoot_m_s, c.overshoot_share * most)
        over = speed - most if since_s <= c.start_s else 0.0
        twice = min(over, self._over_before)
        self._over_before = over
        self._overshoot.threshold = margin
        self._overshoot.push(over if over > 0.0 else 0.0, now_ns, twice >= margin)

        off = self._timing.judge(motion)
        self._mismatch.push(off, now_ns, off > c.mismatch_s)

    def _late_s(self, now_ns: int) -> float:
        """Time since a stop was asked for, while it moves on (s). Motion after a rest is another start."""
        stop_ns = self._commands.stop_ns
        if stop_ns != self._stop_ns:
            self._stop_ns, self._stopped = stop_ns, self._motion.resting
        if stop_ns < 0 or self._motion.resting:
            self._stopped = True
        done = self._stopped or self._motion.standing or now_ns < stop_ns
        return 0.0 if done else (now_ns - stop_ns) * 1e-9


def _fresh(inputs: Inputs, name: str, known_ns: int) -> Sequence[Sample]:
    """What is new of an input; at first, what came before all inputs were there."""
    if known_ns < 0 and not inputs.new.get(name) and name in inputs.latest:
        return (inputs.latest[name],)
    return inputs.new.get(name, ())
