"""A stage for tests of the core: scripted detectors in a registry in memory; a test says what was indicated."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import msgspec

from foreshock.config import Config, DetectorEntry, PolicyEntry, SupervisorSettings
from foreshock.detector import Detector, DetectorSpec, Input, Inputs
from foreshock.evidence import Window
from foreshock.hookspecs import hookimpl
from foreshock.messages import Scalar
from foreshock.policy import ActionSpec, PolicySpec, Proposal, Situation
from foreshock.records import Decision, Indication, Sample, SampleRef
from foreshock.registry import Registry
from foreshock.supervisor import Supervisor
from foreshock.taxonomy import PrecursorKind
from foreshock.trust import Gates, TrustSettings

MS = 1_000_000
SLIP, TORSO, COM = "foot-micro-slip", "torso-angular-spike", "com-lateral-deviation"
Answer = Any
"""What an update gives: a sequence of Indication, or whatever a rogue gives instead."""


def said(
    kind: str, present: bool, stamp_ns: int, *, subject: str = "", severity: float = 1.0, tte: float | None = None
) -> Indication:
    """A well-formed indication."""
    evidence = (SampleRef("talos/x", stamp_ns),)
    return Indication(
        kind, subject, stamp_ns, present, float(present), 0.5, "1", severity if present else 0.0, evidence, tte
    )


class Scripted:
    """Says at each update what ``script(now_ns)`` gives; an exception instance is raised."""

    def __init__(self, script: Callable[[int], Answer]) -> None:
        self._script = script
        self.resets: list[int] = []
        self.inputs: list[Inputs] = []

    def reset(self, seed: int) -> None:
        self.resets.append(seed)

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        self.inputs.append(inputs)
        answer = self._script(now_ns)
        if isinstance(answer, BaseException):
            raise answer
        return answer


class Nothing(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """No settings."""


class ScriptedPolicy:
    """Proposes what ``script(situation)`` gives."""

    def __init__(self, script: Callable[[Situation], Any]) -> None:
        self._script = script

    def propose(self, situation: Situation) -> Sequence[Proposal]:
        return self._script(situation)


def detector(
    id_: str, kinds: Sequence[str], build: Callable[[int], Answer] | Detector, channel: str = "x", **fields: Any
) -> DetectorSpec:
    """Spec of a scripted detector on one Scalar channel; ``channel=""`` for no input at all."""
    inputs = (Input("value", channel, Scalar, max_age_s=fields.pop("max_age_s", 0.05)),) if channel else ()
    made = build if hasattr(build, "update") else Scripted(build)  # type: ignore[arg-type]
    return DetectorSpec(id_, tuple(kinds), inputs, lambda _: made, **fields)  # type: ignore[arg-type,return-value]


def module(
    detectors: Sequence[DetectorSpec] = (),
    policies: Sequence[PolicySpec] = (),
    precursors: Sequence[PrecursorKind] = (),
) -> SimpleNamespace:
    """A plugin module in memory."""

    @hookimpl
    def foreshock_detectors() -> Sequence[DetectorSpec]:
        return detectors

    @hookimpl
    def foreshock_policies() -> Sequence[PolicySpec]:
        return policies

    @hookimpl
    def foreshock_precursors() -> Sequence[PrecursorKind]:
        return precursors

    return SimpleNamespace(
        foreshock_detectors=foreshock_detectors,
        foreshock_policies=foreshock_policies,
        foreshock_precursors=foreshock_precursors,
    )


def stage(
    *specs: DetectorSpec,
    policy: Callable[[Situation], Any] | None = None,
    actions: tuple[ActionSpec, ...] = (),
    window: Window | None = None,
    trust: TrustSettings | None = None,
    gates: Gates | None = None,
    release_s: float = 1.0,
    modules: Mapping[str, Any] | None = None,
) -> Supervisor:
    """A supervisor over these detectors, each in a plugin of its own, under a scripted policy (none proposed)."""
    script = policy or (lambda _: ())
    plugins: dict[str, Any] = {s.id: module([s]) for s in specs}
    plugins["stage"] = module(policies=[PolicySpec("stage", lambda _: ScriptedPolicy(script), Nothing, actions)])
    config = Config(
        tuple(DetectorEntry(s.id) for s in specs),
        supervisor=SupervisorSettings(release_s=release_s),
        window=window or Window(),
        trust=trust or TrustSettings(),
        gates=gates or Gates(),
        policies=(PolicyEntry("stage"),),
    )
    return Supervisor(config, registry=Registry(modules={**plugins, **(modules or {})}))


def fresh(now_ns: int, channel: str = "x", value: Any = 0.0, **fields: Any) -> Sample:
    """A Scalar sample stamped now."""
    content = Scalar(value) if isinstance(value, (int, float)) else value
    return Sample(fields.get("stamp_ns", now_ns), f"talos/{channel}", content)


def play(
    supervisor: Supervisor,
    ticks: int,
    period_ns: int = 10 * MS,
    *,
    channels: Sequence[str] = ("x",),
    samples: Callable[[int, int], Sequence[Sample]] | None = None,
    first: int = 1,
) -> list[Decision]:
    """Step at ``k * period_ns`` for k = first .. ticks, with a fresh sample per channel unless ``samples(k, now)``."""
    decisions = []
    for k in range(first, ticks + 1):
        now = k * period_ns
        arrived = [fresh(now, c) for c in channels] if samples is None else samples(k, now)
        decisions.append(supervisor.step(arrived, now))
    return decisions


def health_of(decisions: Sequence[Decision], source: str) -> list[tuple[str, str]]:
    """(state, reason) of each change of one source."""
    return [(h.state, h.reason) for d in decisions for h in d.health if h.source == source]
