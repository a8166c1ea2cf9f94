"""A foreign recording, a ROS 2 bag, through a supervisor: so that an integrator tunes on the robot's own data.

Topics become channels by a table ``[topics]`` in the configuration, or by their name: ``/talos/joints/state`` is the
channel ``talos/joints/state``. A sample's stamp is its header's; it arrives when the bag says that it was received.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from foreshock.config import Config
from foreshock.errors import BadInputError, ConfigError, MissingExtraError, nearest
from foreshock.journal import Journal
from foreshock.records import Decision, Sample
from foreshock.registry import Registry
from foreshock.supervisor import Supervisor
from foreshock.wire import BY_ROS, message_of, stamp_of, typestore

__all__ = ["BagReplay", "replay_bag"]

LONGEST_GAP_S = 3600.0
"""Without any message; every tick of it would be made."""


class BagReplay(msgspec.Struct, frozen=True):
    """What a supervisor made of a bag.

    Attributes:
        bag: its path.
        ticks: that were made.
        seconds: from the first message to the last.
        samples: by channel.
        missing: channels that a detector needs and no topic gave.
        unread: topics that nothing maps to a channel.
        faults: how many messages could not be read, by topic, with the last reason.
        levels: ticks at each protection level.
        first_s: when each precursor kind was first present, from the first message.
        series: columns over time: ``t_s``, trust, and of each kind and subject its statistic and threshold.
        units: of both, by kind and subject.
    """

    bag: str
    ticks: int
    seconds: float
    samples: dict[str, int]
    missing: tuple[str, ...]
    unread: tuple[str, ...]
    faults: dict[str, str]
    levels: dict[str, int]
    first_s: dict[str, float]
    series: dict[str, list[float]]
    units: dict[str, str]


def replay_bag(
    path: Path,
    config: Config,
    topics: Mapping[str, str],
    base: Path | None = None,
    registry: Registry | None = None,
    journals: Sequence[Journal] = (),
    done: Callable[[Decision], None] | None = None,
) -> BagReplay:
    """Run a bag through a supervisor.

    Args:
        path: of the bag: a folder with metadata.yaml, or an .mcap or .db3 file.
        config: of the supervisor.
        topics: channel below the robot's, by topic.
        base: folder that relative paths of the configuration start from.
        registry: of plugins.
        journals: records of the run.
        done: told of each decision.

    Raises:
        BadInputError: no bag, or a broken one, no topic of it is a channel that a detector reads, or a gap of more than
            LONGEST_GAP_S.
        MissingExtraError: rosbags is not installed.
    """
    supervisor = Supervisor(config, base, registry)
    robot = config.supervisor.robot
    wanted = dict(supervisor.channels())
    reader = _Reader(path, {t: f"{robot}/{c}" for t, c in topics.items()}, robot)
    log = _Series()
    counts: dict[str, int] = {}
    levels: dict[str, int] = {}
    ticks, period = 0, supervisor.period_ns
    began = next_ns = last_ns = -1
    waiting: list[Sample] = []

    def tick(now_ns: int) -> None:
        nonlocal ticks, waiting
        decision = supervisor.step(waiting, now_ns)
        for journal in journals:
            journal.tick(waiting, decision, supervisor.verdicts_of(decision))
        if done is not None:
            done(decision)
        log.add((now_ns - began) / 1e9, decision)
        name = decision.level.name.lower().replace("_", "-")
        levels[name] = levels.get(name, 0) + 1
        ticks, waiting = ticks + 1, []

    try:
        for sample in reader.samples():
            if began < 0:
                began, next_ns = sample.received_ns, sample.received_ns + period
                supervisor.reset(0, began)
            gap_s = (sample.received_ns - next_ns) / 1e9
            if gap_s > LONGEST_GAP_S:
                problem = f"the next message after {(next_ns - began) / 1e9:.1f} s is {gap_s:.0f} s later"
                hint = f" ({sample.channel}); at most {LONGEST_GAP_S:g} s: split the bag there"
                raise BadInputError(str(path), problem, hint)
            while sample.received_ns > next_ns:
                tick(next_ns)
                next_ns += period
            waiting.append(sample)
            counts[sample.channel] = counts.get(sample.channel, 0) + 1
            last_ns = sample.received_ns
        if waiting:
            tick(next_ns)
    finally:
        supervisor.close()
    if not set(counts) & set(wanted):
        channels = ", ".join(sorted(wanted)) or "none by name"
        hint = f"; the bag has {', '.join(reader.topics) or 'no topics'}; map them under [topics]"
        raise BadInputError(str(path), f"no topic is a channel that a detector reads ({channels})", hint)
    missing = tuple(sorted(supervisor.required_channels() - set(counts)))
    seconds = (last_ns - began) / 1e9
    return BagReplay(
        str(path),
        ticks,
        seconds,
        counts,
        missing,
        reader.unread,
        reader.faults(),
        levels,
        log.first_s,
        log.columns,
        log.units,
    )


class _Reader:
    """Samples of a bag, in order of arrival."""

    def __init__(self, path: Path, channels: Mapping[str, str], robot: str) -> None:
        try:
            from rosbags.highlevel import AnyReader
        except ImportError as e:
            hint = "; run: pip install 'foreshock[zenoh]'"
            raise MissingExtraError("replay", f"{e.name} is not installed", hint) from e
        try:
            self._reader = AnyReader([path], default_typestore=typestore())
            self._reader.open()
        except Exception as e:  # noqa: BLE001 # a broken file makes the readers of MCAP, SQLite and YAML raise anything
            raise BadInputError(str(path), f"is no bag that can be read: {_said(e)}") from None
        self._path = path
        self.topics = tuple(sorted({c.topic for c in self._reader.connections}))
        for topic in channels:
            if topic not in self.topics:
                self._reader.close()
                raise ConfigError(f"topics.{topic}", "there is no such topic in the bag", nearest(topic, self.topics))
        self._channels: dict[str, str] = {}
        unread = []
        for c in self._reader.connections:
            channel = channels.get(c.topic, c.topic.lstrip("/"))
            if c.msgtype in BY_ROS and (c.topic in channels or channel.startswith(f"{robot}/")):
                self._channels[c.topic] = channel
            else:
                unread.append(f"{c.topic} ({c.msgtype})")
        self.unread = tuple(sorted(unread))
        self._numbers = dict.fromkeys(self._channels, 0)
        self._faults: dict[str, tuple[int, str]] = {}

    def faults(self) -> dict[str, str]:
        """How many messages could not be read, by topic, with the last reason."""
        return {t: f"{n} of {self._numbers[t]} cannot be read; {why}" for t, (n, why) in self._faults.items()}

    def samples(self) -> Iterator[Sample]:
        """All that can be read; what cannot is noted.

        Raises:
            BadInputError: the bag itself is broken.
        """
        numbers = self._numbers
        try:
            for connection, received_ns, raw in self._messages():
                topic = connection.topic
                numbers[topic] += 1
                try:
                    ros: Any = self._reader.deserialize(raw, connection.msgtype)
                    value, stamp_ns = message_of(connection.msgtype, ros), stamp_of(ros)
                except Exception as e:  # noqa: BLE001 # bytes of a stranger make the decoder raise anything
                    count = self._faults.get(topic, (0, ""))[0] + 1
                    self._faults[topic] = (count, f"message {numbers[topic]}: {_said(e)}")
                    continue
                at_ns = received_ns if stamp_ns is None or stamp_ns == 0 else stamp_ns
                yield Sample(at_ns, self._channels[topic], value, numbers[topic], received_ns)
        finally:
            self._reader.close()

    def _messages(self) -> Iterator[tuple[Any, int, bytes]]:
        chosen = [c for c in self._reader.connections if c.topic in self._channels]
        try:
            # no connection at all would mean every one to rosbags
            yield from self._reader.messages(chosen) if chosen else ()
        except Exception as e:  # noqa: BLE001 # as where it is opened
            said = f"is broken after {sum(self._numbers.values())} messages: {_said(e)}"
            raise BadInputError(str(self._path), said) from None


def _said(e: Exception) -> str:
    return f"{type(e).__name__}: {' '.join(str(e).split())}"


class _Series:
    """Statistics and thresholds over time."""

    def __init__(self) -> None:
        self.columns: dict[str, list[float]] = {"t_s": []}
        self.first_s: dict[str, float] = {}
        self.units: dict[str, str] = {}

    def add(self, t_s: float, d: Decision) -> None:
        """Take a tick."""
        row = {"t_s": t_s, "trust": d.trust.trust, "control_trust": d.trust.control_trust}
        for i in d.indications:
            name = f"{i.kind}@{i.subject}" if i.subject else i.kind
            row[f"stat:{name}"], row[f"threshold:{name}"] = i.statistic, i.threshold
            row[f"present:{name}"] = float(i.present)
            self.units[name] = i.unit
            if i.present:
                self.first_s.setdefault(i.kind, t_s)
        n = len(self.columns["t_s"])
        for key, value in row.items():
            self.columns.setdefault(key, [math.nan] * n).append(value)
        for column in self.columns.values():
            if len(column) <= n:
                column.append(math.nan)
