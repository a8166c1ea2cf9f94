"""The supervisor: a configuration made into a pipeline, stepped with samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec

from foreshock._strict import convert, within
from foreshock.clock import NS_PER_S
from foreshock.config import Config, DetectorEntry, load_config
from foreshock.containment import Contained
from foreshock.detector import Detector, DetectorSpec, Input
from foreshock.errors import BadInputError, ConfigError, ForeshockError, MissingExtraError, PluginError, nearest
from foreshock.isolation import ChildDetector
from foreshock.journal import OperatorReset
from foreshock.pipeline import Pipeline, State
from foreshock.policy import ACTIONS, Arbiter
from foreshock.records import Decision, Lease, Sample
from foreshock.registry import Registry
from foreshock.taxonomy import Taxonomy, builtin_taxonomy
from foreshock.trust import LevelState, TrustModel
from foreshock.verdicts import verdict_in

__all__ = ["OperatorReset", "Supervisor", "build_detector"]


MAX_TTL_S = 1.0
"""A lease lives no longer: a robot at 1.5 m/s covers 1.5 m before it stops for a supervisor that died."""
SILENT_PERIODS = 2
"""A supervisor whose last tick is more periods old than this has stopped, and grants nothing."""


class Supervisor:
    """Judges a robot's samples tick by tick. It supervises; it never replaces low-level control.

    Args:
        config: what to run.
        base: folder that relative paths of the configuration start from.
        registry: where plugins are looked up; the installed ones by default.
        epoch: of its leases, 0 or more. A live supervisor must take one higher than every earlier one of the same
            robot (its start time in ns), so that the robot-side guard fences off one that was replaced but still runs.
            Two of the same epoch are not fenced from each other; 0 is for simulation and replay.

    Raises:
        BadInputError: the configuration names something that does not exist or does not fit; epoch is no such int.
    """

    def __init__(
        self, config: Config, base: Path | None = None, registry: Registry | None = None, *, epoch: int = 0
    ) -> None:
        if type(epoch) is not int or epoch < 0:
            raise ConfigError("epoch", f"{epoch!r} is not an int of 0 or more", "; take the start time in ns")
        self.config = config
        registry = registry or Registry()
        specs = [registry.detector(d.use, f"detectors[{k}].use") for k, d in enumerate(config.detectors)]
        policies = [registry.policy(p.use, f"policies[{k}].use") for k, p in enumerate(config.policies)]
        taxonomy = builtin_taxonomy().extended(registry.precursors())
        if config.supervisor.taxonomy:
            taxonomy = taxonomy.extended_from((base or Path()) / config.supervisor.taxonomy)
        self.taxonomy = taxonomy
        contained = [
            contain(spec, entry, f"detectors[{k}]", config.supervisor.robot, taxonomy)
            for k, (spec, entry) in enumerate(zip(specs, config.detectors, strict=True))
        ]
        contained.sort(key=lambda c: c.spec.id)
        actions = {**ACTIONS, **{a.id: a for p in policies for a in p.actions}}
        self._pipeline = Pipeline(
            contained,
            config.window,
            config.risk.build(base or Path(), taxonomy, config.window.length_s),
            TrustModel(config.trust, taxonomy, {k for c in contained for k in c.kinds}),
            config.gates,
            [
                p.build(convert(entry.config, p.config, f"policies[{k}].config"))
                for k, (p, entry) in enumerate(zip(policies, config.policies, strict=True))
            ],
            Arbiter(actions, config.supervisor.release_s),
            taxonomy,
        )
        self.period_ns = round(config.supervisor.period_s * NS_PER_S)
        self.resets: list[OperatorReset] = []
        self._state = State()
        self._epoch = epoch
        self._may_move = False
        self._stepped_ns = 0
        self.reset(0)

    @classmethod
    def from_file(cls, path: Path, registry: Registry | None = None, *, epoch: int = 0) -> Supervisor:
        """The supervisor that a TOML file describes."""
        return cls(load_config(path), path.parent, registry, epoch=epoch)

    @property
    def detectors(self) -> tuple[DetectorSpec, ...]:
        """Specs of the detectors that run, by id."""
        return tuple(c.spec for c in self._pipeline.detectors)

    def inputs(self) -> list[Input]:
        """What the detectors read by name, with full channels."""
        return [i for c in self._pipeline.detectors for i in c.inputs if i.channel != "*"]

    def channels(self) -> list[tuple[str, type]]:
        """Every channel that a detector reads by name, with the message class that it wants there."""
        return [(i.channel, i.type) for i in self.inputs()]

    def required_channels(self) -> frozenset[str]:
        """Channels without which some detector observes nothing."""
        return frozenset(i.channel for i in self.inputs() if i.required)

    def reset(self, seed: int, now_ns: int = 0) -> None:
        """Forget everything; warm-up begins at now_ns."""
        self._state = self._pipeline.reset(seed, now_ns)
        self._may_move = False
        self.resets.clear()

    def step(self, samples: Sequence[Sample], now_ns: int, verdicts: Mapping[str, str] | None = None) -> Decision:
        """Decide on what arrived until now_ns.

        Args:
            samples: those that arrived since the last step, in order of arrival.
            now_ns: time of the tick, on the supervisor's timeline; it must not go backwards.
            verdicts: recorded wall-clock verdicts (late, hung) by detector id; in a replay, what verdicts_of() gave.

        Raises:
            ForeshockError: now_ns lies before the previous tick.
            BadInputError: a verdict on a detector that does not run, or one that is not a str.
        """
        self._may_move = False  # whatever raises below must not leave the last permission standing
        if now_ns < self._state.trust.at_ns:
            raise ForeshockError(f"time goes backwards: tick at {now_ns} ns after {self._state.trust.at_ns} ns")
        self._state, decision = self._pipeline.step(self._state, samples, now_ns, verdicts)
        self._stepped_ns = now_ns
        self._may_move = decision.motion_permitted
        return decision

    def verdicts_of(self, decision: Decision) -> dict[str, str]:
        """What step() must be given as verdicts in a replay to decide the same without clocks and child processes.

        Holds the verdicts that were passed in and those on children that hung, died or raised.
        """
        ids = {c.spec.id for c in self._pipeline.detectors}
        found = {h.source: verdict_in(h.reason) for h in decision.health if h.source in ids and h.state == "failed"}
        return {name: verdict for name, verdict in found.items() if verdict is not None}

    def operator_reset(self, who: str, why: str, now_ns: int, dimension: str = "") -> OperatorReset:
        """Release latched levels; what still demands protection demands it again in the next tick.

        The record decides as samples do: whoever keeps a journal gives it to Journal.operator_reset.

        Args:
            who: the operator.
            why: what was checked.
            now_ns: now, on the supervisor's timeline.
            dimension: of trust, that is released: ``overall``, an accident mode's code, a class's id; ``""`` for all.

        Raises:
            BadInputError: who or why is empty, or there is no such dimension.
        """
        for name, value in (("who", who), ("why", why)):
            if not value.strip():
                raise BadInputError(f"operator_reset.{name}", "empty; a reset is recorded with who and why")
        state, fresh = self._state, LevelState()
        codes, classes = self.taxonomy.codes, [c.id for c in self.taxonomy.classes]
        if dimension not in ("", "overall", *codes, *classes):
            hint = nearest(dimension, ["overall", *codes, *classes])
            raise BadInputError("operator_reset.dimension", f"no dimension of trust {dimension!r}", hint)
        record = OperatorReset(now_ns, who, why, dimension)
        self.resets.append(record)
        self._state = msgspec.structs.replace(
            state,
            overall=fresh if dimension in ("", "overall") else state.overall,
            levels={m: s for m, s in state.levels.items() if dimension not in ("", m)},
            class_levels={c: s for c, s in state.class_levels.items() if dimension not in ("", c)},
        )
        return record

    def lease(self, nonce: int, guard_ns: int, now_ns: int, ttl_s: float = 0.1) -> Lease | None:
        """Permission to move, in answer to a guard's request.

        None in warm-up, at minimal risk, after a step that raised, and when the supervisor has stopped stepping: its
        last tick is more than two periods before now_ns, or after it (another timeline).

        Args:
            nonce: of the request.
            guard_ns: of the request, on the guard's clock.
            now_ns: now, on the supervisor's timeline.
            ttl_s: time to live from guard_ns, above 0 and at most 1 s.

        Raises:
            ConfigError: ttl_s is out of range.
        """
        within("lease.ttl_s", ttl_s, 0.0, MAX_TTL_S, above=True)
        if not self._may_move or not 0 <= now_ns - self._stepped_ns <= SILENT_PERIODS * self.period_ns:
            return None
        return Lease(self._epoch, nonce, guard_ns, round(ttl_s * NS_PER_S))

    def close(self) -> None:
        """End child processes; idempotent."""
        for c in self._pipeline.detectors:
            close = getattr(c.detector, "close", None)
            if close is not None:
                close()


def inputs_of(spec: DetectorSpec, config: object) -> tuple[Input, ...]:
    """The inputs of a detector with this configuration."""
    return spec.inputs(config) if callable(spec.inputs) else spec.inputs


def kinds_of(spec: DetectorSpec, config: object, place: str) -> tuple[str, ...]:
    """The kinds that a detector reports with this configuration.

    Raises:
        PluginError: its function gives none, or one that the spec does not declare.
    """
    if spec.reports is None:
        return spec.kinds
    kinds = spec.reports(config)
    if not kinds:
        raise PluginError(place, f"detector {spec.id!r} reports nothing with this configuration")
    for kind in kinds:
        if kind not in spec.kinds:
            raise PluginError(place, f"detector {spec.id!r} does not declare {kind!r}", nearest(kind, spec.kinds))
    return kinds


def build_detector(spec: DetectorSpec, config: object, place: str) -> Detector:
    """A detector in this process.

    Raises:
        MissingExtraError: a package that it needs is not installed; says which command installs it.
        BadInputError: its settings do not fit.
        PluginError: anything else that its build raises.
    """
    try:
        return spec.build(config)
    except ImportError as e:
        extra = f"foreshock[{spec.extra}]" if spec.extra else e.name or "its package"
        problem = f"detector {spec.id!r} needs {e.name or e}, which is not installed"
        raise MissingExtraError(place, problem, f"; run: pip install '{extra}'") from e
    except BadInputError as e:
        raise type(e)(f"{place}.config: {e.place}", e.problem, e.hint) from e
    except Exception as e:
        raise PluginError(place, f"detector {spec.id!r} cannot be built: {type(e).__name__}: {e}") from e


def contain(spec: DetectorSpec, entry: DetectorEntry, place: str, robot: str, taxonomy: Taxonomy) -> Contained:
    """A detector behind its guard, with its channels bound."""
    settings = convert(entry.config, spec.config, f"{place}.config")
    inputs = inputs_of(spec, settings)
    names = {i.name for i in inputs}
    for setting, given in (("channels", entry.channels), ("standstill_s", entry.standstill_s)):
        for name in given:
            if name not in names:
                where = f"{place}.{setting}.{name}"
                raise ConfigError(where, f"detector {spec.id!r} has no such input", nearest(name, names))
    for name, value in entry.standstill_s.items():
        within(f"{place}.standstill_s.{name}", value, 0.0)
    bound = [
        i
        if i.channel == "*"
        else msgspec.structs.replace(
            i,
            channel=f"{robot}/{entry.channels.get(i.name, i.channel)}",
            max_standstill_s=entry.standstill_s.get(i.name, i.max_standstill_s),
        )
        for i in inputs
    ]
    told = msgspec.structs.replace(spec, kinds=kinds_of(spec, settings, place))
    if (entry.isolation or spec.isolation) == "process":
        return Contained(told, ChildDetector(spec, settings, place), bound, taxonomy)
    return Contained(told, build_detector(spec, settings, place), bound, taxonomy)
