"""One policy behind several gates, paired: what a risk model is worth is what it saves and what it costs.

All arms take the paper's four protocols together; they differ only in what opens the gate. Severities may be drawn per
seed, so that some runs fall whatever is done and some recover alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec
import numpy as np

from foreshock.session.isolated import Failure, Job, run_all
from foreshock.session.rates import Frequency, Rate, per_hour, wilson
from foreshock.session.run import Arm, Run
from foreshock.session.scenario import Scenario

__all__ = ["GATES", "Gate", "GateResult", "compare_gates", "drawn"]


class Gate(msgspec.Struct, frozen=True):
    """What opens the gate: a policy over a configuration."""

    label: str
    policy: str
    config: dict[str, Any] = {}


GATES = (
    Gate("independent LE, T < 0.3", "paper-gate", {"risk": {"model": "independent"}}),
    Gate("correlated LE with lift, T < 0.3", "paper-gate", {"risk": {"model": "correlated", "parameters": "table-3"}}),
    Gate("two of three precursors", "count-rule"),
)


class GateResult(msgspec.Struct, frozen=True):
    """What one gate did.

    Attributes:
        gate: its label.
        fell: runs in which anything happened in the plant.
        saved: of the runs that fell unsupervised, those that did not fall here.
        caused: runs that fell here but not unsupervised.
        spared: of the runs that came to no harm unsupervised, those in which the gate opened: false interventions.
        lead_s: time from the opening of the gate to the unsupervised fall, one per run that had both.
        nominal_opened: how often it opened in nominal operation.
        nominal_h: simulated hours of nominal operation.
        failures: runs that gave no result.
    """

    gate: str
    fell: Rate
    saved: Rate
    caused: int
    spared: Rate
    lead_s: tuple[float, ...]
    nominal_opened: int
    nominal_h: float
    failures: int

    @property
    def nominal(self) -> Frequency:
        """False interventions in nominal operation."""
        return per_hour(self.nominal_opened, self.nominal_h)


def drawn(ranges: Mapping[str, tuple[float, float]], seed: int) -> dict[str, float]:
    """Parameters of one run, uniform within their ranges, from its seed."""
    rng = np.random.default_rng([0x6761746573, seed])
    return {name: float(rng.uniform(low, high)) for name, (low, high) in sorted(ranges.items())}


def opened(run: Run) -> list[float]:
    """Times at which the gate opened: any action of the mode begins while none holds."""
    held: set[str] = set()
    times = []
    for i in run.interventions:
        if i.mode != run.mode:
            continue
        if i.strength > 0.0:
            if not held:
                times.append(i.stamp_ns / 1e9)
            held.add(i.action)
        else:
            held.discard(i.action)
    return times


def compare_gates(
    scenario: Scenario,
    nominal: Sequence[Scenario],
    seeds: Sequence[int],
    nominal_seeds: Sequence[int],
    ranges: Mapping[str, tuple[float, float]],
    workers: int = 1,
    gates: Sequence[Gate] = GATES,
    done: Callable[[int, Run | Failure], None] | None = None,
) -> list[GateResult]:
    """Every gate on the same seeds.

    Args:
        scenario: with the accident; run unsupervised, and under every gate.
        nominal: scenarios in which nothing is wrong, judged by every gate without acting.
        seeds: of the scenario.
        nominal_seeds: of the nominal scenarios.
        ranges: of parameters that are drawn per seed.
        workers: number of processes.
        gates: to compare.
        done: told of each run as it ends.
    """
    jobs: list[Job] = []
    arms: list[tuple[Arm, Gate]] = [("off", gates[0])]
    arms += [("on", gate) for gate in gates]
    for arm, gate in arms:
        jobs += [Job(_under(scenario, gate).with_(drawn(ranges, s)), arm, s, detail=False) for s in seeds]
    for gate in gates:
        jobs += [Job(_under(n, gate), "shadow", s, detail=False) for n in nominal for s in nominal_seeds]
    results = run_all(jobs, workers, None, done)
    n, calm = len(seeds), len(nominal) * len(nominal_seeds)
    reference = results[:n]
    found = []
    for k, gate in enumerate(gates):
        mine = results[(k + 1) * n : (k + 2) * n]
        at = (len(gates) + 1) * n + k * calm
        found.append(_judged(gate.label, reference, mine, results[at : at + calm]))
    return found


def _under(scenario: Scenario, gate: Gate) -> Scenario:
    return scenario.with_(policy=gate.policy, config=gate.config)


def _judged(
    label: str, reference: Sequence[Run | Failure], mine: Sequence[Run | Failure], calm: Sequence[Run | Failure]
) -> GateResult:
    pairs = [(a, b) for a, b in zip(reference, mine, strict=True) if isinstance(a, Run) and isinstance(b, Run)]
    harmed = [(a, b) for a, b in pairs if a.events]
    unharmed = [(a, b) for a, b in pairs if not a.events]
    nominal = [r for r in calm if isinstance(r, Run)]
    return GateResult(
        label,
        wilson(sum(bool(b.events) for _, b in pairs), len(pairs)),
        wilson(sum(not b.events for _, b in harmed), len(harmed)),
        sum(bool(b.events) for _, b in unharmed),
        wilson(sum(bool(opened(b)) for _, b in unharmed), len(unharmed)),
        tuple(a.events[0].stamp_ns / 1e9 - opened(b)[0] for a, b in harmed if opened(b)),
        sum(len(opened(r)) for r in nominal),
        sum(r.end_s for r in nominal) / 3600.0,
        sum(isinstance(r, Failure) for r in (*reference, *mine, *calm)),
    )
