"""The first-party policies: what they ask for at which level, and settings that would fail open."""

from __future__ import annotations

import math

import pytest

from foreshock._strict import convert
from foreshock.errors import ConfigError
from foreshock.policy import Situation
from foreshock.records import Precursor, ProtectionLevel
from foreshock_detectors.policies import (
    PROTOCOLS,
    CountRule,
    CountRuleConfig,
    Ladder,
    LadderConfig,
    PaperGate,
    PaperGateConfig,
)


def situation(level: ProtectionLevel, overall: float = 1.0) -> Situation:
    return Situation(0, {"A1": level}, {"A1": overall}, overall, level, (), None)


def actions(policy: Ladder | PaperGate, level: ProtectionLevel, overall: float = 1.0) -> set[str]:
    return {p.action for p in policy.propose(situation(level, overall))}


def test_the_ladder_climbs() -> None:
    ladder = Ladder(LadderConfig())
    assert actions(ladder, ProtectionLevel.NORMAL) == set()
    assert actions(ladder, ProtectionLevel.CAUTION, 0.55) == {"speed-scale", "step-suppression"}
    assert actions(ladder, ProtectionLevel.PROTECTIVE, 0.2) == {"speed-scale", "impact-mitigation", *PROTOCOLS}


def test_the_papers_gate_does_nothing_before_it() -> None:
    gate = PaperGate(PaperGateConfig())
    assert actions(gate, ProtectionLevel.CAUTION, 0.55) == set()
    assert actions(gate, ProtectionLevel.PROTECTIVE, 0.2) == set(PROTOCOLS)


def test_a_mode_may_be_named_by_its_id() -> None:
    """Its level is looked up by the code; one that is missing would count as the worst."""
    calm, hot = situation(ProtectionLevel.NORMAL), situation(ProtectionLevel.PROTECTIVE)
    for policy in (
        Ladder(LadderConfig("fall-onto-human")),
        PaperGate(PaperGateConfig("fall-onto-human")),
        CountRule(CountRuleConfig("fall-onto-human")),
    ):
        assert list(policy.propose(calm)) == []
        assert {p.mode for p in policy.propose(hot)} <= {"A1"}


def test_speed_never_rises_when_trust_falls_and_nan_is_slowest() -> None:
    ladder = Ladder(LadderConfig())
    speeds = [ladder.speed(k / 200) for k in range(201)]
    assert speeds == sorted(speeds)
    assert (speeds[0], speeds[-1]) == (0.1, 1.0)
    assert ladder.speed(math.nan) == 0.1


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"slowest": 7.0}, "slowest: 7.0 is not a share"),
        ({"full_speed_trust": math.nan}, "full_speed_trust"),
        ({"full_speed_trust": 0.3, "stop_trust": 0.75}, "full_speed_trust"),
        ({"mode": "A99"}, "unknown accident mode 'A99'"),
        ({"caution": ["step-supression"]}, "did you mean 'step-suppression'"),
        ({"protective": ["balance-lok"]}, "did you mean 'balance-lock'"),
        ({"slowst": 0.1}, "did you mean 'slowest'"),
    ],
)
def test_settings_that_would_fail_open_are_refused(settings: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigError, match=message.replace("(", r"\(")):
        convert(settings, LadderConfig, "policies[0].config")


def test_the_count_rule_acts_on_two_of_the_cascade_whatever_trust_says() -> None:
    rule = CountRule(CountRuleConfig())
    seen = [
        Precursor(kind, "", "ongoing", 1.0, 1.0, 1.0, 0, "d") for kind in ("foot-micro-slip", "torso-angular-spike")
    ]
    other = Precursor("grip-micro-slip", "", "ongoing", 1.0, 1.0, 1.0, 0, "d")

    def asked(*precursors: Precursor) -> set[str]:
        trusting = Situation(0, {}, {}, 1.0, ProtectionLevel.NORMAL, precursors, None)
        return {p.action for p in rule.propose(trusting)}

    assert asked(*seen) == set(PROTOCOLS)
    assert asked(seen[0], other) == asked(seen[0]) == asked() == set()
    with pytest.raises(ConfigError, match=r"least: 4 is not within 1\.\.3"):
        CountRuleConfig(least=4)
