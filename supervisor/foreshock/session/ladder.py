"""Every state of evidence of an accident mode, through the real supervisor: worse evidence never lowers the level.

A state gives each kind of the mode's cascade (Table 3) a phase and says whether it is still observed; with it goes a
predicted time to the accident. Each state is reached by a history of its own, from a supervisor at rest. Of two states
that differ in one step of one kind, or in one step of time, the worse one must have at least the level of the other.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from types import SimpleNamespace
from typing import Any

import msgspec

from foreshock.clock import NS_PER_S
from foreshock.config import Config, DetectorEntry, PolicyEntry, SupervisorSettings
from foreshock.detector import DetectorSpec, Input, Inputs, NoConfig
from foreshock.hookspecs import hookimpl
from foreshock.messages import Scalar
from foreshock.records import Indication, ProtectionLevel, Sample, SampleRef
from foreshock.registry import Registry
from foreshock.supervisor import Supervisor
from foreshock.taxonomy import builtin_taxonomy

__all__ = ["PHASES", "TIMES_S", "Broken", "Cell", "KindState", "check_ladder"]

PHASES: Mapping[str, tuple[float, float]] = {
    "absent": (math.inf, math.inf),
    "cleared": (2.2, 2.6),
    "onset": (2.6, math.inf),
    "ongoing": (0.8, math.inf),
}
"""From better to worse: when the kind is present, in s. Ongoing lasts longer than the window, and counts twice."""
TIMES_S = (math.inf, 2.0, 1.0, 0.5, 0.2)
"""Predicted times to the accident, from better to worse; inf: none is predicted."""
TICK_S, END_S, LOST_S, MAX_AGE_S = 0.2, 3.2, 2.8, 0.3


class KindState(msgspec.Struct, frozen=True, order=True):
    """Of one kind: index of its phase, and whether its detector has gone silent."""

    phase: int
    lost: bool

    def worse(self) -> Iterator[KindState]:
        """One step worse: a later phase, or no longer observed."""
        if self.phase + 1 < len(PHASES):
            yield KindState(self.phase + 1, self.lost)
        if not self.lost:
            yield KindState(self.phase, True)

    def __str__(self) -> str:
        return list(PHASES)[self.phase] + (" (lost)" if self.lost else "")


States = tuple[KindState, ...]


class Cell(msgspec.Struct, frozen=True):
    """What the supervisor does in one state: level of the mode and overall, trust of the mode, actions that hold."""

    states: States
    time_s: float
    level: ProtectionLevel
    overall: ProtectionLevel
    trust: float
    actions: tuple[str, ...]


class Broken(msgspec.Struct, frozen=True):
    """Two states of which the worse has the lower level."""

    better: Cell
    worse: Cell


class Told:
    """A detector that says what its channel says: below 0 absent, else present, the number being the time left (s)."""

    def __init__(self, kind: str) -> None:
        self._kind = kind

    def reset(self, seed: int) -> None:
        """Nothing to forget."""

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:  # noqa: ARG002 # judged by source stamp
        """One indication."""
        sample = inputs.latest["told"]
        assert isinstance(sample.value, Scalar)  # noqa: S101 # the core checked the declared type
        left_s = sample.value.data
        present = left_s >= 0.0
        time_s = left_s if present and left_s < NEVER_S else None
        ref = SampleRef(sample.channel, sample.stamp_ns)
        severity = float(present)
        return [Indication(self._kind, "", sample.stamp_ns, present, severity, 0.5, "1", severity, (ref,), time_s)]


NEVER_S = 1e6
"""Stands for no prediction: a sample carries finite numbers only."""


def check_ladder(
    mode: str,
    policies: Sequence[PolicyEntry],
    tables: Mapping[str, Any] | None = None,
    done: Callable[[], None] | None = None,
) -> tuple[list[Cell], list[Broken]]:
    """Every state of the mode, and every pair that breaks the order.

    Args:
        mode: code of the accident mode.
        policies: to run.
        tables: further fields of the configuration, e.g. gates.
        done: told of each state.
    """
    taxonomy = builtin_taxonomy()
    kinds = [taxonomy.kind(k).id for k in taxonomy.mode(mode).cascade]
    specs = tuple(_spec(kind) for kind in kinds)
    plugin = SimpleNamespace(foreshock_detectors=hookimpl(lambda: specs, specname="foreshock_detectors"))
    entries = tuple(DetectorEntry(spec.id) for spec in specs)
    settings = SupervisorSettings("robot", TICK_S)
    config = Config(entries, settings, policies=tuple(policies), **(tables or {}))
    # one plugin offers all of them, under the name of each
    supervisor = Supervisor(config, registry=Registry({spec.id: plugin for spec in specs}))
    each = [KindState(phase, lost) for phase in range(len(PHASES)) for lost in (False, True)]
    cells: dict[tuple[States, int], Cell] = {}
    try:
        for states in product(each, repeat=len(kinds)):
            for k, time_s in enumerate(TIMES_S):
                cells[states, k] = _reach(supervisor, mode, kinds, states, time_s)
                if done is not None:
                    done()
    finally:
        supervisor.close()
    return list(cells.values()), list(_broken(cells))


def _spec(kind: str) -> DetectorSpec:
    need = Input("told", f"{kind}/told", Scalar, max_age_s=MAX_AGE_S)
    return DetectorSpec(f"told-{kind}", (kind,), (need,), lambda _: Told(kind), NoConfig)


def _reach(supervisor: Supervisor, mode: str, kinds: Sequence[str], states: States, time_s: float) -> Cell:
    supervisor.reset(0)
    spans = list(PHASES.values())
    decision = None
    for k in range(1, round(END_S / TICK_S) + 1):
        t = k * TICK_S
        now_ns = round(t * NS_PER_S)
        samples = []
        for kind, state in zip(kinds, states, strict=True):
            begin, end = spans[state.phase]
            if state.lost and t > LOST_S:
                continue
            told = min(time_s, NEVER_S) if begin <= t + 1e-9 < end else -1.0
            samples.append(Sample(now_ns, f"robot/{kind}/told", Scalar(told), k, now_ns))
        decision = supervisor.step(samples, now_ns)
    assert decision is not None  # noqa: S101 # there are ticks
    actions = tuple(i.action for i in decision.interventions if i.strength > 0.0)
    overall = ProtectionLevel.NORMAL if decision.level is not ProtectionLevel.MINIMAL_RISK else decision.level
    return Cell(states, time_s, decision.levels[mode], overall, decision.trust.control_by_mode[mode], actions)


def _broken(cells: Mapping[tuple[States, int], Cell]) -> Iterator[Broken]:
    for (states, k), cell in cells.items():
        others = [(states, k + 1)] if k + 1 < len(TIMES_S) else []
        for i, state in enumerate(states):
            others += [((*states[:i], worse, *states[i + 1 :]), k) for worse in state.worse()]
        for key in others:
            worse_cell = cells[key]
            if worse_cell.level < cell.level or worse_cell.overall < cell.overall:
                yield Broken(cell, worse_cell)
