"""The live supervisor: Zenoh streams in, a tick at its rate on the monotonic clock, decisions and the lease out.

One thread does everything: at each tick it takes what the rings hold, decides, tells the robot, answers questions.
Zenoh fills the rings from threads of its own, so that a slow or flooding peer costs its own samples and nobody else's.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, cast

from foreshock.clock import NS_PER_S, monotonic_ns, sleep_until, wall_ns
from foreshock.errors import BadInputError, ConfigError
from foreshock.journal import DigestJournal
from foreshock.link import keys_of, open_link, ros_tokens
from foreshock.live._config import RunConfig
from foreshock.live._denied import DeniedPeers
from foreshock.live._handshake import Handshakes
from foreshock.live._intake import Intake
from foreshock.live._journal import SegmentedJournal, segment_path
from foreshock.live._publish import decision_bytes
from foreshock.live._robot import RobotLink
from foreshock.live._services import MOST_PEERS, Services
from foreshock.live._status import Status, TickTimes, stream_status
from foreshock.live._stream import Stream
from foreshock.recording import Head, McapJournal, check_writable
from foreshock.records import Decision, ProtectionLevel
from foreshock.registry import Registry
from foreshock.supervisor import Supervisor
from foreshock.wire import ROS_NAMES, Codec, typestore

__all__ = ["LiveSupervisor"]

BY_NAME = {cls.__name__: cls for cls in ROS_NAMES}


class LiveSupervisor:
    """Runs until it is told to stop.

    Attributes:
        unrecorded: why the journal cannot be written any more; no lease is granted then. Empty while all is well.

    Args:
        run: what to run.
        base: folder that relative paths of the configuration start from.
        registry: of plugins.
        journal: one file to record everything in, instead of the folder that the configuration names.
        denied: who was turned away, if somebody watches the log; see watch_log.

    Raises:
        BadInputError: the configuration does not fit, the link cannot be opened, or the journal cannot be written.
    """

    def __init__(
        self,
        run: RunConfig,
        base: Path | None = None,
        registry: Registry | None = None,
        journal: Path | None = None,
        denied: DeniedPeers | None = None,
    ) -> None:
        base = base or Path()
        self._run, self.epoch = run, wall_ns()
        if journal is None and run.journal.folder:
            check_writable(segment_path(base / run.journal.folder, run.config.supervisor.robot, self.epoch, 0))
        elif journal is not None:
            check_writable(journal)
        self.supervisor = Supervisor(run.config, base, registry, epoch=self.epoch)
        robot = run.config.supervisor.robot
        channels = _channels(run, self.supervisor)
        typestore()  # its definitions take half a second to load: not in the first tick
        self._session = cast("Any", open_link(run.link, base))
        try:
            keys = keys_of(run.link, robot)
            codec = Codec()
            self._streams = [
                Stream(self._session, keys, channel, cls, codec, run.live.max_skew_s)
                for channel, cls in sorted(channels.items())
            ]
            self._intake = Intake(self._streams, self.supervisor.period_ns)
            self._robot = RobotLink(self._session, keys, run.live, self.epoch)
            self._decisions = self._session.declare_publisher(keys.service("decision"))
            self._services = Services(self._session, keys)
            self._handshakes = Handshakes(self._session, keys, self.supervisor.inputs(), channels)
            self._tokens = ros_tokens(self._session, keys, "MS", {c: ROS_NAMES[cls] for c, cls in channels.items()})
            self._token = self._session.liveliness().declare_token(keys.alive("supervisor", str(self.epoch)))
            self._began_ns = self._opened_ns = monotonic_ns()
            self._digest = DigestJournal()
        except BaseException:
            self._session.close()
            raise
        self._denied = denied
        if denied is not None:
            denied.names = self._names
        self._base = base
        self._journal_file = journal
        self._journal: SegmentedJournal | McapJournal | None = None
        self.unrecorded = ""
        self._needed = self.supervisor.required_channels()
        self._missing = sorted(self._needed) or [s.channel for s in self._streams]
        self._times = TickTimes()
        self._history: deque[tuple[int, bytes]] = deque()
        self._health: dict[str, str] = {}
        self._decision: Decision | None = None
        self._published_ns = -1
        self._level: tuple[ProtectionLevel, ...] = ()

    def run(self, stop: threading.Event, ticked: Callable[[Decision], None] | None = None) -> Status:
        """Tick until stop is set; what there is to say at the end.

        Args:
            stop: ends it.
            ticked: told of each decision.
        """
        period_ns = self.supervisor.period_ns
        next_ns = monotonic_ns() + period_ns
        try:
            while not stop.is_set():
                sleep_until(next_ns)
                began_ns = monotonic_ns()
                decision = self.tick(began_ns)
                ended_ns = monotonic_ns()
                self._times.add(ended_ns - began_ns)
                if ticked is not None and decision is not None:
                    ticked(decision)
                next_ns += period_ns
                if next_ns < ended_ns:
                    self._times.overruns += 1
                    next_ns = ended_ns
            return self.status()
        finally:
            self.close()

    def tick(self, now_ns: int) -> Decision | None:
        """One tick at this time of the monotonic clock; None while streams have not begun, so that nothing is judged.

        Nobody may move then, since no lease is granted.
        """
        samples = self._intake.drain(now_ns)
        if self._missing:
            self._missing = self._silent()
            if self._missing:
                self._services.refuse_resets(f"nothing is latched yet: waiting for {', '.join(self._missing)}")
                self._answer()
                return None
            self.supervisor.reset(0, now_ns)
            self._began_ns = now_ns
            with self._recording():
                self._journal = self._open_journal()
        for reset in self._services.resets(self.supervisor, now_ns):
            self._digest.operator_reset(reset)
            with self._recording():
                if self._journal is not None:
                    self._journal.operator_reset(reset)
        decision = self.supervisor.step(samples, now_ns)
        self._robot.hear(now_ns)
        self._robot.tell(decision, now_ns)
        self._decision = decision
        self._handshakes.update(self._services.peers(), now_ns)
        self._robot.grant(self.supervisor, now_ns, permitted=not self._withheld(now_ns))
        verdicts = self.supervisor.verdicts_of(decision)
        self._digest.tick(samples, decision, verdicts)
        with self._recording():
            if self._journal is not None:
                self._journal.tick(samples, decision, verdicts)
        for h in decision.health:
            if h.state == "ok":
                self._health.pop(h.source, None)
            else:
                self._health[h.source] = f"{h.state}: {h.reason}" if h.reason else h.state
        self._publish(decision, now_ns)
        self._answer()
        return decision

    @contextmanager
    def _recording(self) -> Iterator[None]:
        """Around what writes to the journal: where it cannot be written, it ends, and the lease with it."""
        try:
            yield
        except BadInputError as e:
            self.unrecorded, self._journal = str(e), None

    def _withheld(self, now_ns: int) -> str:
        """Why nobody may move, beside what the decision says; empty if nothing forbids it."""
        if self._missing:
            return f"waiting for {', '.join(self._missing)}"
        if self.unrecorded:
            return self.unrecorded
        if refused := self._handshakes.refused:
            return "; ".join(f"{twin} is refused: {why}" for twin, why in refused.items())
        if waiting := self._handshakes.waiting:
            return "; ".join(f"{twin} has not said yet what it is" for twin in waiting)
        if self._services.crowded:
            return f"more than {MOST_PEERS} peers are there, and what the others are is not known"
        if doubted := self._doubted():
            return f"the clock of {', '.join(doubted)} has jumped"
        if twice := self._robot.twice(now_ns):
            return f"two guards are called {', '.join(map(repr, twice))}, or it has begun again within 1 s"
        if overdue := self._robot.overdue(now_ns):
            return f"no guard has acknowledged {', '.join(overdue)}"
        return ""

    def _doubted(self) -> list[str]:
        """Streams whose clock has just jumped: nobody moves on them, however old their last believed sample may be."""
        return [s.channel for s in self._streams if s.doubted and (s.channel in self._needed or not self._needed)]

    def _silent(self) -> list[str]:
        """Streams that have not begun, of those that are needed; where none is, all of them until any has."""
        silent = [s.channel for s in self._streams if s.arrived_ns < 0]
        if self._needed:
            return [c for c in silent if c in self._needed]
        return silent if len(silent) == len(self._streams) else []

    def _answer(self) -> None:
        self._services.answer(self.status, self._run, self.supervisor.taxonomy, self._history)

    def status(self) -> Status:
        """What there is to say, after the last tick."""
        now_ns, d, log = monotonic_ns(), self._decision, self._denied
        withheld = self._withheld(now_ns)
        return Status(
            robot=self._run.config.supervisor.robot,
            epoch=self.epoch,
            uptime_s=(now_ns - self._opened_ns) / NS_PER_S,
            tick=-1 if d is None else d.tick,
            tick_ms=self._times.milliseconds(),
            overruns=self._times.overruns,
            level="" if d is None else d.level.name.lower(),
            levels={} if d is None else {m: v.name.lower() for m, v in d.levels.items() if v},
            trust=0.0 if d is None else d.trust.trust,
            control_trust=0.0 if d is None else d.trust.control_trust,
            trust_by_mode={} if d is None else d.trust.control_by_mode,
            motion_permitted=d is not None and d.motion_permitted and not withheld,
            withheld=withheld,
            leases=self._robot.granted,
            guards={name: (now_ns - at) / NS_PER_S for name, at in self._robot.guards.items()},
            unacknowledged=tuple(self._robot.overdue(now_ns)),
            unknown_actions=self._robot.unknown,
            interventions={} if d is None else {i.action: i.strength for i in d.interventions},
            precursors=()
            if d is None
            else tuple(f"{p.kind}@{p.subject}" if p.subject else p.kind for p in d.precursors if p.phase != "cleared"),
            streams={s.channel: stream_status(s, now_ns) for s in self._streams},
            health=self._not_ok(),
            peers=self._services.peers(),
            links=tuple(
                sorted(f"{x.dst} {x.auth_identifier or 'without a certificate'}" for x in self._session.info.links())
            ),
            denied=() if log is None else log.denied(now_ns),
            refused=() if log is None else log.refused(now_ns),
            journal="" if self._journal is None else str(self._journal.path),
        )

    def _not_ok(self) -> dict[str, str]:
        """State and reason of every detector and channel that is not ok, with what is wrong with its stream."""
        found = dict(self._health)
        for s in self._streams:
            if s.fault:
                found[s.channel] = "; ".join([*([found[s.channel]] if s.channel in found else []), f"link: {s.fault}"])
        if self._denied is not None and self._denied.fault:
            found["link log"] = self._denied.fault
        return found

    def _names(self) -> dict[str, str]:
        """Names in the certificates of the peers that are connected, by Zenoh id."""
        return {str(x.zid): x.auth_identifier or "" for x in self._session.info.links()}

    def close(self) -> None:
        """End the link, the journal and child processes; idempotent."""
        with ExitStack() as ends:
            ends.callback(self._session.close)
            ends.callback(self.supervisor.close)
            if self._journal is not None:
                ends.callback(self._journal.close)

    def _publish(self, decision: Decision, now_ns: int) -> None:
        level = (decision.level, *decision.levels.values())
        due = now_ns - self._published_ns >= NS_PER_S / self._run.live.decision_hz
        if not due and level == self._level:
            return
        self._level, self._published_ns = level, now_ns
        health = self._not_ok()
        if withheld := self._withheld(now_ns):
            health["lease"] = f"withheld: {withheld}"
        data = decision_bytes(decision, self.epoch, self._digest.digest, health)
        self._decisions.put(data)
        self._history.append((now_ns, data))
        while self._history and now_ns - self._history[0][0] > self._run.live.history_s * NS_PER_S:
            self._history.popleft()

    def _open_journal(self) -> SegmentedJournal | McapJournal | None:
        settings, base = self._run.journal, self._base
        head = Head(self._run.tables, str(base.resolve()), 0, self._began_ns)
        if self._journal_file is not None:
            return McapJournal(self._journal_file, head)
        if not settings.folder:
            return None
        robot = self._run.config.supervisor.robot
        return SegmentedJournal(base / settings.folder, robot, self.epoch, head, settings, wall_ns() / NS_PER_S)


def _channels(run: RunConfig, supervisor: Supervisor) -> dict[str, type]:
    """Every channel that a detector reads, or that the configuration adds, with its message class.

    Raises:
        ConfigError: two detectors want different types on one channel.
    """
    found: dict[str, type] = {}
    robot = run.config.supervisor.robot
    for channel, cls in supervisor.channels():
        if found.setdefault(channel, cls) is not cls:
            problem = f"{cls.__name__} and {found[channel].__name__} are both read from it"
            raise ConfigError(f"channel {channel}", problem)
    for name, kind in run.live.streams.items():
        found.setdefault(f"{robot}/{name}", BY_NAME[kind])
    if not found:
        raise BadInputError("live.streams", "no detector reads a channel, and none is given")
    return found
