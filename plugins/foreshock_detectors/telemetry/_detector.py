"""The telemetry detector: sorts samples by channel into links."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase

from foreshock.detector import Inputs
from foreshock.records import Indication
from foreshock_detectors.telemetry._channel import ChannelTrack
from foreshock_detectors.telemetry._config import TelemetryConfig
from foreshock_detectors.telemetry._link import Link

__all__ = ["TelemetryDetector"]


class TelemetryDetector:
    """Implements foreshock.detector.Detector.

    Until of every link the period of one channel is known, and while a heartbeat is malformed, nothing is said of any
    link, so that all kinds are unobserved. A channel that no link claims is not supervised.
    """

    def __init__(self, config: TelemetryConfig) -> None:
        self._config = config
        self.reset(0)

    def reset(self, seed: int) -> None:  # noqa: ARG002  # nothing here is random
        """Forget everything."""
        self._links = tuple(Link(name, self._config) for name in self._config.links)
        self._tracks: dict[str, tuple[Link, ChannelTrack] | None] = {}

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        """Four indications per link."""
        tracks = self._tracks
        for sample in inputs.new.get("any", ()):
            channel = sample.channel
            entry = tracks[channel] if channel in tracks else self._enter(channel)
            if entry is not None:
                entry[0].push(entry[1], sample)
        for link in self._links:
            if link.malformed or not link.ready():
                return ()
        if len(self._links) == 1:
            return self._links[0].indications(now_ns)
        return [indication for link in self._links for indication in link.indications(now_ns)]

    def _enter(self, channel: str) -> tuple[Link, ChannelTrack] | None:
        """Find the link of a new channel."""
        config = self._config
        below = channel.partition("/")[2] or channel
        entry = None
        for link in self._links:
            if any(fnmatchcase(below, pattern) for pattern in config.links[link.subject]):
                period = next((p for pattern, p in config.period_s.items() if fnmatchcase(below, pattern)), 0.0)
                aperiodic = any(fnmatchcase(below, pattern) for pattern in config.aperiodic)
                entry = (link, ChannelTrack(channel, config, period, aperiodic))
                link.channels.append(entry[1])
                break
        self._tracks[channel] = entry
        return entry
