"""The baselines: what triggers each, what does not, and settings that would leave an arm without effect."""

from __future__ import annotations

import pytest

from foreshock._strict import convert
from foreshock.errors import ConfigError
from foreshock.policy import Situation
from foreshock.records import Precursor, ProtectionLevel
from foreshock.registry import Registry
from foreshock_detectors import baselines
from foreshock_detectors.baselines import (
    CapturePoint,
    CapturePointConfig,
    ReactiveStop,
    ReactiveStopConfig,
    SpeedSeparation,
    SpeedSeparationConfig,
    Stl,
    StlConfig,
)
from foreshock_detectors.protocols import PROTOCOLS

SLIP, TORSO, COM, BREACH = (
    "foot-micro-slip",
    "torso-angular-spike",
    "com-lateral-deviation",
    "human-proximity-breach",
)
NOW_NS = 3_000_000_000
PROTECTIVE = set(PROTOCOLS["A1"].protective)


def seen(kind: str, onset_s: float = 2.9, phase: str = "ongoing", severity: float = 1.0, **fields: object) -> Precursor:
    onset_ns = round(onset_s * 1e9)
    return Precursor(kind, "", phase, severity, 1.0, 1.0, onset_ns, "d", onsets_ns=(onset_ns,), **fields)


def acts(policy, *precursors: Precursor, time_s: float | None = None, mode: str = "A1") -> bool:
    """Whether it acts although trust is whole: no baseline asks the model."""
    times = {} if time_s is None else {mode: time_s}
    trusting = Situation(NOW_NS, {}, {}, 1.0, ProtectionLevel.NORMAL, precursors, time_s, times)
    proposals = policy.propose(trusting)
    assert policy.propose(trusting) == proposals, "pure"
    assert {p.action for p in proposals} in (set(), PROTECTIVE)
    assert all((p.strength, p.level, p.mode) == (1.0, ProtectionLevel.PROTECTIVE, "A1") for p in proposals)
    return bool(proposals)


@pytest.mark.parametrize("kind", [SLIP, TORSO, COM])
def test_the_reactive_stop_acts_on_any_single_kind_of_the_cascade(kind: str) -> None:
    stop = ReactiveStop(ReactiveStopConfig("fall-onto-human"))
    assert acts(stop, seen(kind))
    assert acts(stop, seen(kind, phase="cleared"))
    assert not acts(stop)
    assert not acts(stop, seen(BREACH), seen("grip-micro-slip"), time_s=0.0)


def test_speed_and_separation_acts_on_a_breach_that_lasts_or_is_lost_from_sight() -> None:
    policy = SpeedSeparation(SpeedSeparationConfig("A1"))
    assert acts(policy, seen(BREACH))
    assert not acts(policy, seen(BREACH, phase="cleared"))
    assert acts(policy, seen(BREACH, phase="cleared", frozen=True))
    assert not acts(policy, seen(SLIP), seen(TORSO), seen(COM), time_s=0.0)
    wider = SpeedSeparation(SpeedSeparationConfig("A1", kinds=("narrowing-clearance",)))
    assert acts(wider, seen("narrowing-clearance"))
    assert not acts(wider, seen(BREACH))


def test_the_capture_point_acts_on_a_near_fall_or_a_deviating_centre_of_mass() -> None:
    policy = CapturePoint(CapturePointConfig())
    assert acts(policy, time_s=0.5)
    assert not acts(policy, time_s=0.51)
    assert not acts(policy, time_s=0.1, mode="A6"), "the time to another accident is no fall"
    assert acts(policy, seen(COM))
    assert not acts(policy, seen(COM, phase="cleared"))
    assert not acts(policy, seen(SLIP), seen(TORSO), seen(BREACH))
    assert not acts(CapturePoint(CapturePointConfig(deviation=False)), seen(COM))


def test_a_formula_acts_in_the_very_tick_that_violates_it() -> None:
    policy = Stl(StlConfig("A1"))
    assert not acts(policy, seen(SLIP))
    assert not acts(policy, seen(TORSO))
    assert acts(policy, seen(SLIP), seen(TORSO, 3.0))
    assert not acts(policy, seen("grip-micro-slip"), seen(TORSO))


def test_a_formula_tells_the_order_of_onsets() -> None:
    ordered = "always(not(foot_micro_slip_onset > 0 and eventually[0:1](torso_angular_spike_onset > 0)))"
    policy = Stl(StlConfig("A1", ordered))
    assert acts(policy, seen(SLIP, 2.5), seen(TORSO, 2.9))
    assert not acts(policy, seen(SLIP, 2.9), seen(TORSO, 2.5))
    assert not acts(policy, seen(SLIP, 1.7), seen(TORSO, 2.9)), "beyond the bound of the formula"


def test_a_formula_about_the_past_and_one_about_severity() -> None:
    past = Stl(StlConfig("A1", "not(torso_angular_spike > 0 and once[0.5:1.0](foot_micro_slip_onset > 0))"))
    assert acts(past, seen(SLIP, 2.3), seen(TORSO, 2.9))
    assert not acts(past, seen(SLIP, 2.8), seen(TORSO, 2.9))
    severe = Stl(StlConfig("A1", "always(com_lateral_deviation_severity < 0.6)"))
    assert acts(severe, seen(COM, severity=0.7))
    assert not acts(severe, seen(COM, severity=0.5))


@pytest.mark.parametrize(
    ("config", "settings", "message"),
    [
        (ReactiveStopConfig, {"mode": "A99"}, "unknown accident mode 'A99'"),
        (ReactiveStopConfig, {}, "mode"),
        (SpeedSeparationConfig, {"mode": "A6", "actions": ["protective-stp"]}, "did you mean 'protective-stop'"),
        (SpeedSeparationConfig, {"mode": "A6", "actions": []}, "actions: empty"),
        (SpeedSeparationConfig, {"mode": "A6", "kinds": []}, "kinds: empty"),
        (SpeedSeparationConfig, {"mode": "A6", "kinds": ["human-proximity"]}, "did you mean 'human-proximity-breach'"),
        (CapturePointConfig, {"within_s": float("nan")}, "within_s: nan is not a finite number above 0"),
        (CapturePointConfig, {"withn_s": 0.1}, "did you mean 'within_s'"),
        (StlConfig, {"mode": "A1", "step_s": 2.0}, "step_s: 2.0 is not a finite number at least 0.001 and at most 1.5"),
    ],
)
def test_settings_are_checked(config: type, settings: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigError, match=message.replace("(", r"\(")):
        convert(settings, config, "policies[0].config")


@pytest.mark.parametrize(
    ("formula", "message"),
    [
        ("always(foot_micro_slp < 0)", "formula: 'foot_micro_slp' is no kind of precursor; did you mean"),
        ("always(1 > 0)", "names no kind of precursor"),
        ("always(foot_micro_slip < ", "RTAMT refuses"),
        ("always[0.03:0.07](foot_micro_slip < 0)", "multiple of the sampling period"),
        ("always(foot_micro_slip > 0)", "violated while no precursor is present"),
    ],
)
def test_a_formula_is_checked(formula: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message.replace("(", r"\(")):
        Stl(StlConfig("A1", formula))


def test_every_mode_has_its_baselines_and_each_says_what_it_is() -> None:
    names = ("capture-point", "reactive-stop", "speed-separation", "stl")
    registry = Registry(dict.fromkeys(names, baselines))
    for name in names:
        spec = registry.policy(name, "policies[0].use")
        assert spec.summary.startswith("baseline: ")
        for mode in PROTOCOLS:
            spec.build(spec.config(mode=mode))
