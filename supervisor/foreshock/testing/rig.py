"""Plays a recording to one detector behind the real supervisor, and keeps what went in and what came out."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from types import SimpleNamespace
from typing import Any

import msgspec

from foreshock.clock import cpu_ns, ns
from foreshock.config import Config, DetectorEntry, SupervisorSettings
from foreshock.detector import Detector, DetectorSpec, Input, Inputs, Isolation
from foreshock.hookspecs import hookimpl
from foreshock.records import Decision, Indication, Sample
from foreshock.registry import Registry
from foreshock.supervisor import Supervisor, inputs_of
from foreshock.taxonomy import PrecursorKind

__all__ = ["Call", "Play", "Rig", "arrival_ns"]


class Call(msgspec.Struct):
    """One update of a detector.

    Attributes:
        now_ns: time of the tick.
        inputs: what it was given.
        said: what it answered, as given; None if it raised.
        error: what it raised, with its type; empty if it did not.
        cpu_ns: CPU time of the update.
        changed: an input or an earlier answer that the update changed; empty if none.
    """

    now_ns: int
    inputs: Inputs
    said: Sequence[Indication] | None
    error: str
    cpu_ns: int
    changed: str = ""


class Play(msgspec.Struct):
    """A recording as played: the decision of every tick, and every update of the detector (none if in a child)."""

    decisions: list[Decision]
    calls: list[Call]

    @property
    def present(self) -> frozenset[str]:
        """Kinds that the core ever took over as present."""
        return frozenset(i.kind for d in self.decisions for i in d.indications if i.present)


class Watched:
    """A detector that keeps a record of its updates.

    Args:
        detector: the object under test.
        calls: where the record goes.
        armed: entered around its own code.
        careful: compare inputs and answers before and after every update.
    """

    def __init__(
        self, detector: Detector, calls: list[Call], armed: Callable[[], AbstractContextManager[None]], careful: bool
    ) -> None:
        self._detector, self._calls, self._armed, self._careful = detector, calls, armed, careful
        self._given: tuple[list[Indication], list[Indication]] = ([], [])

    def reset(self, seed: int) -> None:
        """Reset it."""
        with self._armed():
            self._detector.reset(seed)

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        """Update it."""
        before = Inputs(dict(inputs.latest), {name: tuple(new) for name, new in inputs.new.items()})
        call = Call(now_ns, inputs, None, "", 0)
        self._calls.append(call)
        began_ns = cpu_ns()
        try:
            with self._armed():
                call.said = self._detector.update(now_ns, inputs)
        except BaseException as e:  # what is not an Exception is contained by the core as well
            call.error = f"{type(e).__name__}: {e}"
            raise
        finally:
            call.cpu_ns = cpu_ns() - began_ns
            if self._careful:
                call.changed = self._changes(before, inputs, call.said)
        return call.said

    def _changes(self, before: Inputs, after: Inputs, said: Sequence[Indication] | None) -> str:
        (kept, copied), self._given = self._given, ([], [])
        if isinstance(said, (list, tuple)):
            self._given = (list(said), copy.deepcopy(list(said)))
        if dict(after.latest) != before.latest or {name: tuple(new) for name, new in after.new.items()} != before.new:
            return "its inputs"
        if kept != copied:
            return "its previous answer"
        return ""


class Rig:
    """One detector behind the real supervisor, with no policy.

    Args:
        spec: what the detector declares.
        config: its settings; the defaults if not given.
        precursors: kinds that its plugin adds to the taxonomy.
        robot: first part of every channel of the recordings.
        tick_s: tick period.
    """

    def __init__(
        self,
        spec: DetectorSpec,
        config: msgspec.Struct | None = None,
        precursors: Iterable[PrecursorKind] = (),
        robot: str = "talos",
        tick_s: float = 0.005,
    ) -> None:
        self.spec, self.robot, self.tick_ns = spec, robot, ns(tick_s)
        self.settings: Any = spec.config() if config is None else config
        self.inputs: dict[str, Input] = {i.name: i for i in inputs_of(spec, self.settings)}
        self._precursors = tuple(precursors)
        entry = DetectorEntry(spec.id, config=msgspec.to_builtins(self.settings))
        self._config = Config((entry,), SupervisorSettings(robot, tick_s), policies=())

    def channel(self, name: str) -> str:
        """Full channel of an input."""
        return f"{self.robot}/{self.inputs[name].channel}"

    def play(
        self,
        samples: Sequence[Sample],
        *,
        until_ns: int = 0,
        isolation: Isolation = "in-process",
        armed: Callable[[], AbstractContextManager[None]] = nullcontext,
        careful: bool = False,
    ) -> Play:
        """Play samples in their order of arrival to a new detector.

        Args:
            samples: what arrives, at least one sample; see arrival_ns.
            until_ns: go on ticking until then, though nothing arrives any more.
            isolation: where the detector runs.
            armed: entered around the detector's own code.
            careful: see Watched.
        """
        with self.supervisor(isolation, armed, careful) as (supervisor, calls):
            return Play(self.run(supervisor, samples, until_ns), calls)

    @contextmanager
    def supervisor(
        self,
        isolation: Isolation = "in-process",
        armed: Callable[[], AbstractContextManager[None]] = nullcontext,
        careful: bool = False,
    ) -> Iterator[tuple[Supervisor, list[Call]]]:
        """A supervisor with the detector as its only one, and the growing record of its updates."""
        calls: list[Call] = []
        build = self.spec.build

        def watched(config: Any) -> Detector:
            return Watched(build(config), calls, armed, careful)

        spec = self.spec
        if isolation == "in-process":
            spec = msgspec.structs.replace(spec, build=watched)
        plugin = SimpleNamespace(
            foreshock_detectors=hookimpl(lambda: (spec,), specname="foreshock_detectors"),
            foreshock_precursors=hookimpl(lambda: self._precursors, specname="foreshock_precursors"),
        )
        entry = msgspec.structs.replace(self._config.detectors[0], isolation=isolation)
        config = msgspec.structs.replace(self._config, detectors=(entry,))
        supervisor = Supervisor(config, registry=Registry({spec.id: plugin}))
        try:
            yield supervisor, calls
        finally:
            supervisor.close()

    def run(self, supervisor: Supervisor, samples: Sequence[Sample], until_ns: int = 0) -> list[Decision]:
        """Reset, then tick from the first arrival to the last, or to until_ns if that is later."""
        tick = self.tick_ns
        now_ns = (arrival_ns(samples[0]) - 1) // tick * tick
        until_ns = max(until_ns, arrival_ns(samples[-1]))
        supervisor.reset(0, now_ns)
        decisions = []
        k = 0
        while now_ns < until_ns:
            now_ns += tick
            first = k
            while k < len(samples) and arrival_ns(samples[k]) <= now_ns:
                k += 1
            decisions.append(supervisor.step(samples[first:k], now_ns))
        return decisions


def arrival_ns(sample: Sample) -> int:
    """When a sample arrives: received_ns, or its stamp where that is not set."""
    return sample.received_ns if sample.received_ns >= 0 else sample.stamp_ns
