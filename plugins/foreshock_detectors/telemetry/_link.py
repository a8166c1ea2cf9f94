"""One link: several channels that share a network, and the four verdicts on it."""

from __future__ import annotations

import math

from foreshock.messages import Heartbeat
from foreshock.records import Indication, Sample, SampleRef
from foreshock_detectors._sequential import EventWindow, Hysteresis, severity
from foreshock_detectors.telemetry._channel import ChannelTrack
from foreshock_detectors.telemetry._config import TelemetryConfig
from foreshock_detectors.telemetry._latency import Latency

__all__ = ["Link"]


class Link:
    """Collects what its channels show.

    Attributes:
        subject: its name.
        channels: the channels heard so far.
        malformed: the last heartbeat carried a round trip that is no time.
    """

    def __init__(self, subject: str, config: TelemetryConfig) -> None:
        self.subject, self._config = subject, config
        self.channels: list[ChannelTrack] = []
        self.malformed = False
        self._round_trip: Latency | None = None
        self._hold_ns = round(config.hold_s * 1e9)
        self._delayed = Hysteresis(config.delay_budget_s, 0.8 * config.delay_budget_s, self._hold_ns)
        self._dropping = Hysteresis(1.0, 0.7, self._hold_ns)
        self._disorder = EventWindow(round(config.reorder_window_s * 1e9))
        self._least_heard = config.loss_least / config.loss_fraction
        self._spike_ns = self._stamp_ns = -1
        self._spike_s, self._spike_limit_s, self._latency_s = 0.0, config.spike_floor_s, 0.0
        self._spike_ref: tuple[SampleRef, ...] = ()
        self._disorder_ref: tuple[SampleRef, ...] = ()
        self._ready = False

    def ready(self) -> bool:
        """Whether it is known how often one of its channels sends, so that its silence would be heard."""
        if not self._ready:
            self._ready = any(track.aperiodic or track.silence_ns > 0.0 for track in self.channels)
        return self._ready

    def push(self, track: ChannelTrack, sample: Sample) -> None:
        """Take the next sample of one of its channels."""
        stamp_ns, seq, arrived_ns = sample.stamp_ns, sample.seq, sample.received_ns
        if arrived_ns < 0:
            arrived_ns = stamp_ns
        value = sample.value
        if type(value) is Heartbeat:
            if seq < 0:
                seq = value.sequence
            if value.sequence == track.beat and stamp_ns > track.stamp_ns:
                return  # sent again and again by something that no longer beats: silence
            track.beat = value.sequence
            self._loop(value.round_trip_s, sample, arrived_ns)
        spiked, disordered = track.push(stamp_ns, seq, arrived_ns)
        self._latency_s = track.latency_s
        if stamp_ns > self._stamp_ns:
            self._stamp_ns = stamp_ns
        if spiked:
            self._spike(track.latency_s, track.latency.limit_s, sample, arrived_ns)
        if disordered:
            self._disorder.add(arrived_ns)
            self._disorder_ref = (SampleRef(sample.channel, stamp_ns),)

    def _loop(self, round_trip_s: float, sample: Sample, arrived_ns: int) -> None:
        """The control loop's own round trip is a latency too; 0 means that the sender measures none."""
        self.malformed = not (math.isfinite(round_trip_s) and round_trip_s >= 0.0)
        if self.malformed or round_trip_s == 0.0:
            return
        if self._round_trip is None:
            self._round_trip = Latency(self._config)
        if self._round_trip.push(round_trip_s, arrived_ns):
            self._spike(round_trip_s, self._round_trip.limit_s, sample, arrived_ns)

    def _spike(self, latency_s: float, limit_s: float, sample: Sample, arrived_ns: int) -> None:
        if arrived_ns - self._spike_ns >= self._hold_ns or self._spike_ns < 0 or latency_s >= self._spike_s:
            self._spike_s, self._spike_limit_s = latency_s, limit_s
            self._spike_ref = (SampleRef(sample.channel, sample.stamp_ns),)
        if arrived_ns > self._spike_ns:
            self._spike_ns = arrived_ns

    def indications(self, now_ns: int) -> tuple[Indication, Indication, Indication, Indication]:
        """Spike, delay, dropout and reordering now."""
        config, subject, stamp = self._config, self.subject, self._stamp_ns
        tracks = self.channels
        slowest = silent = lossy = tracks[0]
        mean_s = quiet = loss = -1.0
        least_heard, fraction = self._least_heard, config.loss_fraction
        for track in tracks:
            if track.latency.mean_s > mean_s:
                mean_s, slowest = track.latency.mean_s, track
            if track.silence_ns > 0.0:
                ratio = (now_ns - track.arrived_ns) / track.silence_ns
                if ratio > quiet:
                    quiet, silent = ratio, track
            lost = track.lost
            if lost > 0.01:
                total = lost + track.heard
                lost /= total if total > least_heard else least_heard
            if lost > loss:
                loss, lossy = lost, track
        if self._round_trip is not None and self._round_trip.mean_s > mean_s:
            mean_s = self._round_trip.mean_s
        quiet = quiet if quiet > 0.0 else 0.0
        loss /= fraction
        gone, worst = (quiet, silent) if quiet > loss else (loss, lossy)
        delayed, dropping = self._delayed.push(mean_s, now_ns), self._dropping.push(gone, now_ns)
        silence_s = (now_ns - silent.arrived_ns) * 1e-9
        disorder = self._disorder.count(now_ns)
        disordered = disorder >= config.reorder_events
        spiking = self._spike_ns >= 0 and now_ns - self._spike_ns < self._hold_ns
        if spiking:
            latency, limit, spike_ref = self._spike_s, self._spike_limit_s, self._spike_ref
            spike_severity = severity(latency, limit, 5.0 * limit)
        else:
            latency, limit, spike_ref, spike_severity = self._latency_s, config.spike_floor_s, (), 0.0
        budget = config.delay_budget_s
        return (
            Indication(
                "control-latency-spike", subject, stamp, spiking, latency, limit, "s", spike_severity, spike_ref
            ),
            Indication(
                "communication-delay", subject, stamp, delayed, mean_s, budget, "s",
                severity(mean_s, budget, 3.0 * budget) if delayed else 0.0,
                (SampleRef(slowest.channel, slowest.stamp_ns),) if delayed else (),
            ),
            Indication(
                "message-dropout", subject, stamp, dropping, gone, 1.0, "1",
                severity(gone, 1.0, 5.0) if dropping else 0.0,
                (SampleRef(worst.channel, worst.stamp_ns),) if dropping else (), None,
                {"loss": loss * fraction, "silence_s": silence_s, "period_s": silent.period_s},
            ),
            Indication(
                "message-reordering", subject, stamp, disordered, float(disorder), float(config.reorder_events), "1",
                severity(disorder, config.reorder_events, config.reorder_events + 9.0) if disordered else 0.0,
                self._disorder_ref if disordered else (),
            ),
        )  # fmt: skip
