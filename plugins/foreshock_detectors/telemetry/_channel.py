"""One channel of a link: its order, losses, period and latency."""

from __future__ import annotations

from foreshock_detectors._sequential import RunningMedian
from foreshock_detectors.telemetry._config import TelemetryConfig
from foreshock_detectors.telemetry._latency import Latency

__all__ = ["ChannelTrack"]

RESTART_BELOW = 64
"""A lower number on a newer stamp is a restarted sender, or one whose counter wrapped, if it is below this."""

MOST_LOST = 10_000
"""A jump of the numbers counts at most so many losses, so that it fades within a minute."""


class ChannelTrack:
    """Follows one channel, message by message, in O(1).

    Attributes:
        channel: its full name.
        stamp_ns: newest source stamp.
        aperiodic: it sends on events.
        arrived_ns: arrival of the newest message, -1 before the first.
        beat: sequence number inside the last heartbeat, if it carries heartbeats.
        latency: its latency beyond the least one seen, plus the base latency.
        latency_s: latency of the last message (s).
        lost: messages lost, fading.
        heard: messages received, fading.
        period_s: expected period (s), 0 while unknown.
        silence_ns: time without a message that counts as silence; 0 while unknown or aperiodic.
    """

    __slots__ = (
        "_backward", "_base_s", "_before_s", "_drift", "_fixed", "_last_s", "_loss_tau_ns", "_offset_s", "_period",
        "_periods", "_silence_floor_ns", "aperiodic", "arrived_ns", "beat", "channel", "heard", "latency", "latency_s",
        "lost", "period_s", "seq", "silence_ns", "stamp_ns",
    )  # fmt: skip

    def __init__(self, channel: str, config: TelemetryConfig, period_s: float, aperiodic: bool) -> None:
        self.channel = channel
        self.latency = Latency(config)
        self._base_s, self._drift = config.base_latency_s, config.clock_drift_ppm * 1e-15
        self._loss_tau_ns = config.loss_time_constant_s * 1e9
        self._periods, self._silence_floor_ns = config.silence_periods * 1e9, config.silence_floor_s * 1e9
        self._period = RunningMedian(least=1e-6, start=9)
        self.aperiodic = aperiodic
        self._fixed = aperiodic or period_s > 0.0
        self.period_s, self.silence_ns = 0.0, 0.0
        if period_s > 0.0 and not aperiodic:
            self._expect(period_s)
        self.seq, self.stamp_ns, self.arrived_ns = -1, -1, -1
        self.beat: int | None = None
        self.lost = self.heard = self.latency_s = 0.0
        self._offset_s = self._before_s = self._last_s = 0.0
        self._backward = 0

    def _expect(self, period_s: float) -> None:
        self.period_s = period_s
        self.silence_ns = max(self._periods * period_s, self._silence_floor_ns)

    def push(self, stamp_ns: int, seq: int, arrived_ns: int) -> tuple[bool, bool]:
        """Take the next message; whether its latency is a spike, and whether it is out of order."""
        raw_s = (arrived_ns - stamp_ns) * 1e-9
        if self.arrived_ns < 0:
            self.seq, self.stamp_ns, self.arrived_ns, self.heard = seq, stamp_ns, arrived_ns, 1.0
            self._offset_s = self._before_s = self._last_s = raw_s
            self.latency_s = self._base_s
            return self.latency.push(self._base_s, arrived_ns), False

        since_ns = arrived_ns - self.arrived_ns
        if since_ns > 0:
            self.arrived_ns = arrived_ns
            fade = self._loss_tau_ns / (self._loss_tau_ns + since_ns)
            self.lost *= fade
            self.heard *= fade
        self.heard += 1.0
        disordered = self._order(stamp_ns, seq)

        # Least latency ever seen, rising with the clocks' drift; of the middle of three, so that one stamp from the
        # future does not make all others look late for ever.
        a, b = self._before_s, self._last_s
        self._before_s, self._last_s = b, raw_s
        if a > b:
            a, b = b, a
        middle = a if raw_s < a else b if raw_s > b else raw_s
        offset = self._offset_s + self._drift * since_ns
        self._offset_s = offset = middle if middle < offset else offset
        latency = self._base_s + raw_s - offset if raw_s > offset else self._base_s
        self.latency_s = latency
        return self.latency.push(latency, arrived_ns), disordered

    def _order(self, stamp_ns: int, seq: int) -> bool:
        """Whether stamp or number go backwards; counts losses and learns the period otherwise."""
        ahead_ns = stamp_ns - self.stamp_ns
        step = seq - self.seq if seq >= 0 and self.seq >= 0 else 1
        if ahead_ns < 0:
            # An overtaken message was counted as lost. A number that goes on, or stamps that stay behind, are a sender
            # whose clock was set back: said once, then followed.
            self._backward += 1
            if step < 0:
                self.lost = max(0.0, self.lost - 1.0)
            if (step > 0 and seq >= 0) or self._backward >= 5:
                self.stamp_ns, self.seq, self._backward = stamp_ns, seq, 0
            return True
        self._backward = 0
        if ahead_ns == 0 and step <= 0:
            return False  # a duplicate
        self.stamp_ns = stamp_ns
        if step <= 0:
            restarted = step == 0 or seq < RESTART_BELOW
            self.seq = seq
            return not restarted
        self.seq = seq
        if step > 1:
            self.lost += step - 1 if step <= MOST_LOST else MOST_LOST
        if not self._fixed and ahead_ns > 0:
            period = self._period
            period.push(ahead_ns * 1e-9 / step)
            if period.ready:
                self._expect(period.value)
        return False
