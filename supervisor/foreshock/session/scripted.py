"""Interventions that nobody decides: those of a supervised run at another moment, or held from the start.

They tell whether the moment of an intervention matters, or only that something is done; and where the supervised run
did nothing, what it costs to do it all the same.
"""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
import numpy as np

from foreshock._strict import convert
from foreshock.clock import ns
from foreshock.config import Config
from foreshock.policy import ACTIONS, MINIMAL_RISK, Arbiter, ArbiterState, Situation
from foreshock.records import Intervention, ProtectionLevel
from foreshock.registry import Registry
from foreshock.taxonomy import builtin_taxonomy

__all__ = ["acts_of", "held", "moved", "protective"]

CHEAP = frozenset({"speed-scale", "announce"})
"""Actions that cost little and are no intervention in the sense of an arm that acts by action."""


def acts_of(changes: Sequence[Intervention], mode: str) -> list[Intervention]:
    """Of a run's interventions the beginnings of those that count: of the mode, or the minimal risk condition."""
    return [
        i
        for i in changes
        if i.strength > 0.0 and i.action not in CHEAP and (i.mode == mode or i.action == MINIMAL_RISK)
    ]


def protective(config: Config, mode: str, registry: Registry) -> tuple[Intervention, ...]:
    """What a configuration's policies do at the protective gate of a mode, from the start: without any evidence.

    Empty of policies that wait for evidence instead of a level.

    Args:
        config: whose policies are asked; conflicts are resolved as in a run.
        mode: code of the mode that is at its gate; all others are at rest.
        registry: of plugins.
    """
    rest = {m.code: ProtectionLevel.NORMAL for m in builtin_taxonomy().modes}
    levels = rest | {mode: ProtectionLevel.PROTECTIVE}
    trust = dict.fromkeys(rest, 1.0) | {mode: 0.0}
    situation = Situation(0, levels, trust, 1.0, ProtectionLevel.NORMAL, (), None)
    specs = [registry.policy(p.use, f"policies[{k}].use") for k, p in enumerate(config.policies)]
    proposals = [
        proposal
        for k, (spec, entry) in enumerate(zip(specs, config.policies, strict=True))
        for proposal in spec.build(convert(entry.config, spec.config, f"policies[{k}].config")).propose(situation)
        if proposal.mode == mode and proposal.level >= ProtectionLevel.PROTECTIVE
    ]
    actions = {**ACTIONS, **{a.id: a for spec in specs for a in spec.actions}}
    return Arbiter(actions, config.supervisor.release_s).step(ArbiterState(), situation, proposals)[1]


def moved(changes: Sequence[Intervention], duration_s: float, seed: int) -> tuple[Intervention, ...]:
    """The interventions of a supervised run, all moved so that the first comes at a random time of the scenario.

    Args:
        changes: of the supervised run, by time.
        duration_s: of the scenario; the time is uniform over it.
        seed: of the run; its stream is separate from those of plant and sensors.
    """
    if not changes:
        return ()
    at_s = np.random.default_rng([0x7265, seed]).uniform(0.0, duration_s)
    by_ns = ns(at_s) - changes[0].stamp_ns
    return tuple(msgspec.structs.replace(i, stamp_ns=i.stamp_ns + by_ns) for i in changes)


def held(changes: Sequence[Intervention]) -> tuple[Intervention, ...]:
    """Every action of a supervised run, from the start, as strong as it became."""
    most: dict[str, Intervention] = {}
    for i in changes:
        if i.action not in most or i.strength > most[i.action].strength:
            most[i.action] = i
    return tuple(msgspec.structs.replace(i, stamp_ns=0) for i in most.values())
