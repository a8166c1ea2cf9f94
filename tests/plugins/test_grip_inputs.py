"""The grip detector: what it does with nothing held, bad samples, gaps, batches, and its configuration."""

from __future__ import annotations

import math

import msgspec
import pytest
from test_grip import KINDS, SPEC, G, Scene, onsets, step, tick

from foreshock.detector import Inputs
from foreshock.errors import ConfigError
from foreshock.messages import GripState
from foreshock_detectors.grip import GripConfig


def test_nothing_held_is_absent_and_says_so() -> None:
    detector = SPEC.build(GripConfig())
    for sample in Scene(lambda t: 0.0, grasping=lambda t: False).samples(0.1, 1000.0):
        last = tick(detector, (sample,))
    assert [(i.kind, i.present, i.measures["held"]) for i in last] == [(kind, False, 0.0) for kind in KINDS]


def test_a_new_grasp_knows_nothing_of_the_last() -> None:
    scene = Scene(lambda t: G if t < 1.0 or t > 2.0 else 0.0, grasping=lambda t: t < 1.0 or t >= 2.0)
    assert onsets(scene, 4.0) == {}


@pytest.mark.parametrize(
    "change",
    [
        {"normal_force": math.nan},
        {"tangential_force": math.inf},
        {"vertical_acceleration": math.nan},
        {"object_mass": -1.0},
    ],
)
def test_a_malformed_sample_leaves_everything_unobserved_and_the_filter_unharmed(change: dict[str, float]) -> None:
    detector, samples = SPEC.build(GripConfig()), Scene().samples(1.0, 1000.0)
    for sample in samples[:500]:
        tick(detector, (sample,))
    bad = msgspec.structs.replace(samples[500], value=msgspec.structs.replace(samples[500].value, **change))
    assert tick(detector, (bad,)) == ()
    assert detector.update(bad.stamp_ns + 1, Inputs({}, {"grip": ()})) == ()  # until a good one comes
    for sample in samples[501:]:
        last = tick(detector, (sample,))
        assert not any(i.present for i in last)
    assert last[0].measures["load_n"] == pytest.approx(G, abs=0.1)


def test_nothing_is_said_before_the_period_is_known() -> None:
    detector, samples = SPEC.build(GripConfig()), Scene().samples(0.1, 100.0)
    assert [bool(tick(detector, (s,))) for s in samples] == [False] * 9 + [True]
    assert samples[9].stamp_ns < SPEC.warm_up_s * 1e9


def test_stale_and_repeated_samples_are_passed_over() -> None:
    samples = Scene(lambda t: G - step(t, 0.5, 0.5)).samples(0.7, 1000.0)
    plain, noisy = SPEC.build(GripConfig()), SPEC.build(GripConfig())
    for i, sample in enumerate(samples):
        expected = tick(plain, (sample,))
        assert tick(noisy, (sample, sample, samples[max(i - 3, 0)])) == expected


def test_a_gap_restarts_the_filter() -> None:
    samples = Scene(lambda t: G if t < 1.0 else 0.8 * G).samples(3.0, 1000.0)
    detector = SPEC.build(GripConfig())
    present = set()
    for sample in samples[:900] + samples[1300:]:
        present |= {i.kind for i in tick(detector, (sample,)) if i.present}
    assert "grip-micro-slip" not in present  # what happened in the gap was not seen


def test_batches_and_single_samples_end_in_the_same_state() -> None:
    samples = Scene(lambda t: G - step(t, 0.5, 0.5)).samples(0.6, 1000.0)
    one, many = SPEC.build(GripConfig()), SPEC.build(GripConfig())
    for k in range(0, len(samples), 10):
        for sample in samples[k : k + 10]:
            expected = tick(one, (sample,))
        assert tick(many, samples[k : k + 10]) == expected


@pytest.mark.parametrize("backend", ["scalar", "filterpy"])
def test_reset_equals_new(backend: str) -> None:
    config = GripConfig(backend=backend)  # type: ignore[arg-type]
    samples = Scene(lambda t: G - step(t, 0.3, 0.5)).samples(0.5, 1000.0)
    used = SPEC.build(config)
    for sample in samples:
        tick(used, (sample,))
    used.reset(1)
    fresh = SPEC.build(config)
    assert [tick(used, (s,)) for s in samples] == [tick(fresh, (s,)) for s in samples]


def test_both_backends_give_the_same_verdicts() -> None:
    scene = Scene(lambda t: 1.3 * G - step(t, 1.2, 0.5), acceleration=lambda t: math.sin(4 * math.pi * t))
    scalar, filterpy = (onsets(scene, 1.6, 1000.0, GripConfig(backend=b)) for b in ("scalar", "filterpy"))  # type: ignore[arg-type]
    assert scalar == filterpy
    assert set(scalar) == {"grip-micro-slip", "mass-misestimation"}


# --- configuration


def test_one_gripper_is_named_grip_and_several_by_their_names() -> None:
    assert callable(SPEC.inputs)
    (only,) = SPEC.inputs(GripConfig())
    assert (only.name, only.channel, only.type, only.required) == ("grip", "left_gripper/state", GripState, True)
    both = GripConfig(grippers=("left_gripper", "right_gripper"))
    assert [(i.name, i.channel) for i in SPEC.inputs(both)] == [
        ("grip-left_gripper", "left_gripper/state"),
        ("grip-right_gripper", "right_gripper/state"),
    ]
    detector, samples = SPEC.build(both), Scene().samples(0.1, 1000.0)
    for s in samples:
        alone = detector.update(s.stamp_ns, Inputs({}, {"grip-left_gripper": (s,)}))
    assert alone == ()  # the right one was never heard
    for s in samples:
        last = detector.update(s.stamp_ns, Inputs({}, {"grip-right_gripper": (s,)}))
    assert {(i.kind, i.subject) for i in last} == {(k, g) for k in KINDS for g in both.grippers}


@pytest.mark.parametrize(
    ("field_", "value"),
    [
        ("noise_n", 0.0),
        ("mass_error", math.nan),
        ("grippers", ()),
        ("grippers", ("a", "a")),
        ("oscillation_low_hz", 50.0),
    ],
)
def test_a_bad_setting_is_named(field_: str, value: object) -> None:
    with pytest.raises(ConfigError, match=f"grip.{field_}"):
        GripConfig(**{field_: value})  # type: ignore[arg-type]


def test_the_spec_declares_what_it_says() -> None:
    assert SPEC.kinds == KINDS
    assert SPEC.extra == "grip"
    assert msgspec.json.schema(SPEC.config)
