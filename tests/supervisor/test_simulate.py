"""Stepped runs on a twin with a little physics: arms, pairing, determinism, and what a run says about itself."""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec
import pytest
from foreshock_stage import COM, SLIP, TORSO, Scripted, module, said

from foreshock.detector import DetectorSpec, Input
from foreshock.errors import ConfigError
from foreshock.journal import MemoryJournal
from foreshock.messages import Scalar
from foreshock.records import Intervention, Sample
from foreshock.registry import Registry
from foreshock.session.run import Arm, Run
from foreshock.session.scenario import Scenario
from foreshock.session.simulate import simulate
from foreshock.supervisor import Supervisor
from foreshock.testing import PendulumTwin, threshold_spec

TIMES: dict[str, float] = {"slip": 0.0, "torso": 0.48, "com": 1.12}
"""Onsets of the paper's case study (section 3.3), s after the slip."""

CONFIG = {
    "supervisor": {"period_s": 0.01},
    "detectors": [
        {"use": "lean", "config": {"threshold": 0.05}},
        {"use": "rate", "config": {"threshold": 0.15}},
        {"use": "kick", "config": {"threshold": 0.1}},
    ],
    "gates": {"latch": "none"},
    "policies": [{"use": "paper-gate"}],
}
LEAN = Scenario("a1-lean", "pushed", "A1", "accident", 3.0, {"kind": "pendulum"}, CONFIG, {"push": 0.4, "noise": 0.002})


def registry() -> Registry:
    kinds = {"lean": COM, "rate": TORSO, "kick": SLIP}
    return Registry(modules={n: module([threshold_spec(n, k, f"body/{n}")]) for n, k in kinds.items()})


class Recorder(PendulumTwin):
    """Keeps what it was told."""

    def __init__(self) -> None:
        self.told: list[Intervention] = []
        super().__init__()

    def intervene(self, intervention: Intervention) -> None:
        self.told.append(intervention)
        super().intervene(intervention)


def run(arm: Arm, seed: int = 0, scenario: Scenario = LEAN, twin: PendulumTwin | None = None) -> Run:
    supervisor = Supervisor(scenario.supervisor(), registry=registry()) if arm != "off" else None
    return simulate(scenario, twin or PendulumTwin(), supervisor, arm, seed)


def test_unsupervised_it_falls_and_supervised_it_does_not() -> None:
    off, on = run("off"), run("on")
    assert (off.accident, off.outcome) == (True, "fall-onto-human")
    assert not on.accident
    # toppling from rest after a push of rate r: x = r / w sinh(w t); 1 rad at t = asinh(w / r) / w after 0.5 s
    w = 9.81**0.5
    assert off.events[0].stamp_ns / 1e9 == pytest.approx(0.5 + math.asinh(w / 0.4) / w, abs=0.02)


def test_shadow_judges_as_off_moves() -> None:
    twin = Recorder()
    shadow, off, on = run("shadow", twin=twin), run("off"), run("on")
    assert twin.told == []
    assert shadow.accident
    assert shadow.interventions != ()
    assert [e.stamp_ns for e in shadow.events] == [e.stamp_ns for e in off.events]
    assert shadow.max_level >= 2
    # until somebody acts, the judged runs are the same run
    assert shadow.gate_s == on.gate_s
    assert shadow.first_s == on.first_s
    first = on.interventions[0].stamp_ns / 1e9
    early = [k for k, t in enumerate(on.series["t_s"]) if t <= first]
    assert [on.series["p"][k] for k in early] == [shadow.series["p"][k] for k in early]


def test_only_actions_that_the_twin_knows_reach_it() -> None:
    twin = Recorder()
    result = run("on", twin=twin)
    assert {i.action for i in twin.told} == {"balance-lock", "step-suppression"}
    assert result.ignored == ("arm-reconfiguration", "compliance-tuning")
    assert [i for i in result.interventions if i.action in twin.actions] == twin.told


def test_same_seed_same_digest_on_used_and_new_objects() -> None:
    twin, supervisor = PendulumTwin(), Supervisor(LEAN.supervisor(), registry=registry())
    digests = [simulate(LEAN, twin, supervisor, "on", seed).digest for seed in (3, 4, 3)]
    assert digests[0] == digests[2] == run("on", 3).digest
    assert digests[0] != digests[1]


def test_the_periods_of_twin_and_supervisor_must_fit() -> None:
    odd = msgspec.structs.replace(LEAN, config={**CONFIG, "supervisor": {"period_s": 0.007}})
    with pytest.raises(ConfigError, match=r"period_s.*0.007 s is not a multiple of the twin's step of 0.005"):
        run("on", scenario=odd)


def test_an_arm_without_its_supervisor_is_refused() -> None:
    with pytest.raises(ConfigError, match="needs a supervisor"):
        simulate(LEAN, PendulumTwin(), None, "shadow", 0)


class Silent(PendulumTwin):
    """Its sensors die at 1 s."""

    def advance(self, until_ns: int) -> Sequence[Sample]:
        return [s for s in super().advance(until_ns) if s.stamp_ns <= 1_000_000_000]


def test_dead_sensors_in_a_run_end_in_minimal_risk_and_are_named() -> None:
    calm = LEAN.with_({"push": 0.0})
    result = run("on", scenario=calm, twin=Silent())
    assert not result.accident
    assert result.max_level == 3
    assert {h.source for h in result.health if h.state == "unobserved"} == {"lean", "rate", "kick"}
    begun = next(i for i in result.interventions if i.action == "minimal-risk").stamp_ns / 1e9
    # 100 ms of age are allowed, then 300 ms of grace
    assert begun == pytest.approx(1.0 + 0.1 + 0.3, abs=0.03)


def test_nominal_runs_are_left_alone() -> None:
    calm = run("on", scenario=LEAN.with_({"push": 0.0}))
    assert (calm.accident, calm.interventions, calm.max_level, calm.outcome) == (False, (), 0, "none")


def test_the_paper_s_case_gives_table_4_in_time() -> None:
    """Three detectors that speak at the paper's instants: P after each onset is Table 4, T < 0.3 only at the third."""
    kinds = {"slip": SLIP, "torso": TORSO, "com": COM}

    def spec(name: str) -> DetectorSpec:
        start = round((0.5 + TIMES[name]) * 1e9)
        scripted = Scripted(lambda now: [said(kinds[name], now >= start, now)])
        return DetectorSpec(name, (kinds[name],), (Input("value", "body/lean", Scalar),), lambda _: scripted)

    config = {
        "supervisor": {"period_s": 0.01},
        "detectors": [{"use": n} for n in TIMES],
        "policies": CONFIG["policies"],
    }
    scenario = Scenario("table-4", "the paper's case", "A1", "open", 1.7, {"kind": "pendulum"}, config)
    supervisor = Supervisor(scenario.supervisor(), registry=Registry(modules={n: module([spec(n)]) for n in TIMES}))
    journal = MemoryJournal()
    result = simulate(scenario, PendulumTwin(), supervisor, "shadow", 0, journals=[journal])
    at = {round(d.now_ns / 1e9, 2): d for _, d in journal.ticks}
    for t, p in ((0.5, 0.1174), (0.98, 0.4546), (1.62, 0.8093)):
        assert at[t].risk.by_mode["A1"] == pytest.approx(p, abs=1e-4)
        assert at[round(t - 0.01, 2)].risk.by_mode["A1"] < p - 0.1
    assert result.gate_s["protective"] == pytest.approx(1.62)
    assert {i.action for i in result.interventions if i.strength == 1.0} == {
        "step-suppression",
        "arm-reconfiguration",
        "compliance-tuning",
        "balance-lock",
    }
