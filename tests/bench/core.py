"""Evidence, risk, trust and policy of one tick with twelve kinds active, beside one update of an STL monitor."""

from __future__ import annotations

import math
import statistics
import time
from pathlib import Path

import rtamt

from foreshock import evidence as ev
from foreshock.policy import ACTIONS, Arbiter, ArbiterState, Situation
from foreshock.records import Indication
from foreshock.risk import CorrelatedRisk, IndependentRisk, LogisticExponential, RiskModel, load_parameters
from foreshock.taxonomy import builtin_taxonomy
from foreshock.trust import Gates, LevelState, TrustModel, TrustSettings, TrustState, edge_step, levels_step
from foreshock_detectors.policies import Ladder, LadderConfig
from tests.bench.rows import Row

__all__ = ["rows"]

TICKS, PERIOD_NS = 4000, 5_000_000
AIM_US = 50.0
TAXONOMY = builtin_taxonomy()
KINDS = tuple(dict.fromkeys(TAXONOMY.kind(k).id for mode in TAXONOMY.modes for k in mode.cascade))[:12]


def indications(tick: int) -> dict[ev.Key, Indication]:
    """Twelve kinds present; their severities wander as those of noisy channels do, new maxima now and then."""
    now = tick * PERIOD_NS
    return {
        (kind, "", f"d{k % 4}"): Indication(
            kind, "", now, True, 1.0, 0.5, "1", 0.5 + 0.4 * math.sin(0.37 * tick + k) * math.sin(0.011 * tick * (k + 1))
        )
        for k, kind in enumerate(KINDS)
    }


def core_us(risk: RiskModel) -> float:
    """Median CPU time of evidence, risk, trust, levels, policy and arbiter in one tick."""
    window, gates = ev.Window(), Gates()
    trust_model = TrustModel(TrustSettings(), TAXONOMY, KINDS)
    edges = gates.edges()
    mode_edges = {mode: g.edges() for mode, g in gates.of_modes(TAXONOMY).items()}
    class_edges = {class_: g.edges() for class_, g in gates.of_classes(TAXONOMY).items()}
    policy, arbiter = Ladder(LadderConfig()), Arbiter(ACTIONS, 1.0)
    evidence, trust_state, overall = ev.Evidence(), TrustState(), LevelState()
    levels, class_levels, arbiter_state = {}, {}, ArbiterState()
    spent = []
    for tick in range(TICKS):
        observed, now = indications(tick), tick * PERIOD_NS
        begin = time.process_time_ns()
        evidence, precursors = ev.step(evidence, window, now, observed)
        estimate = risk.estimate(precursors)
        trust_state, trust, overdue = trust_model.step(trust_state, estimate, (), now)
        overall = edge_step(overall, edges, trust.control_trust, overdue, now)
        levels = levels_step(levels, mode_edges, trust.control_by_mode, now)
        class_levels = levels_step(class_levels, class_edges, trust.control_by_class, now)
        by_mode = {mode: state.level for mode, state in levels.items()}
        situation = Situation(
            now, by_mode, trust.control_by_mode, trust.control_trust, overall.level, precursors, None, {}
        )
        arbiter_state, _, _ = arbiter.step(arbiter_state, situation, policy.propose(situation))
        spent.append(time.process_time_ns() - begin)
    return statistics.median(spent[TICKS // 2 :]) / 1e3


def stl_us() -> float:
    """Median CPU time of one update of RTAMT's ``always[0:100]``."""
    monitor = rtamt.StlDiscreteTimeSpecification()
    monitor.declare_var("x", "float")
    monitor.declare_var("out", "float")
    monitor.spec = "out = always[0:100](x >= 0.3)"
    monitor.parse()
    monitor.pastify()
    spent = []
    for tick in range(TICKS):
        begin = time.process_time_ns()
        monitor.update(tick, [("x", 0.5)])
        spent.append(time.process_time_ns() - begin)
    return statistics.median(spent[TICKS // 2 :]) / 1e3


def rows() -> list[Row]:
    """One row per risk model."""
    reference = stl_us()
    models = {
        "independent": IndependentRisk(LogisticExponential(), TAXONOMY),
        "correlated": CorrelatedRisk(load_parameters("table-3", Path(), TAXONOMY), TAXONOMY),
    }
    found = []
    for name, model in models.items():
        value = core_us(model)
        found.append(
            Row(
                f"evidence, risk ({name}), trust and policy of a tick, 12 kinds active",
                value,
                "us CPU",
                reference,
                "one RTAMT always[0:100] update",
                value / reference,
                f"< {AIM_US:.0f} us",
                value < AIM_US,
            )
        )
    return found
