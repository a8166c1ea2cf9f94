"""A stream that repeats its values with fresh stamps is no evidence: unobserved, named and replayed."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest

from foreshock.channels import ChannelView
from foreshock.clock import NS_PER_S
from foreshock.containment import Contained
from foreshock.detector import DetectorSpec, Input, Inputs
from foreshock.errors import ConfigError
from foreshock.hookspecs import hookimpl
from foreshock.messages import Detections, Heartbeat, HumanPose, Humans, Imu, JointState, Scalar, stands_still
from foreshock.recording import Head, McapJournal
from foreshock.records import Indication, ProtectionLevel, Sample
from foreshock.registry import Registry
from foreshock.session.faults import parse_faults
from foreshock.session.replay import replay
from foreshock.session.run import Run
from foreshock.session.scenario import Scenario
from foreshock.session.simulate import simulate
from foreshock.supervisor import Supervisor
from foreshock.taxonomy import builtin_taxonomy
from foreshock.testing import PendulumTwin, threshold_spec
from foreshock.testing.spec_checks import spec_checks

MS = 1_000_000
STILL_S = 0.1
FREEZE = {"kind": "freeze", "channel": "body/lean", "from_s": 0.4}
LIFTED = {**FREEZE, "until_s": 0.7}


def registry(still_s: float) -> Registry:
    """One threshold detector on the lean, whose input may stand still for so long."""
    spec = threshold_spec("lean", "com-lateral-deviation", "body/lean")
    spec = msgspec.structs.replace(spec, inputs=(Input("value", "body/lean", Scalar, max_standstill_s=still_s),))
    return Registry({"lean": SimpleNamespace(foreshock_detectors=hookimpl(lambda: [spec]))})


def run(
    *tables: Mapping[str, Any], still_s: float = STILL_S, arm: Any = "shadow", entry: Any = None, **more: Any
) -> Run:
    config = {
        "supervisor": {"period_s": 0.01},
        "detectors": [{"use": "lean", "config": {"threshold": 0.05}, **(entry or {})}],
        "policies": [{"use": "paper-gate"}],
    }
    parameters = {"push": 0.4, "noise": 0.002}
    faults = parse_faults(list(tables), "test")
    scenario = Scenario(
        "a1-lean", "pushed", "A1", "accident", 1.5, {"kind": "pendulum"}, config, parameters, faults=faults
    )
    return simulate(
        scenario, PendulumTwin(), Supervisor(scenario.supervisor(), registry=registry(still_s)), arm, 0, **more
    )


def told(frozen: Run) -> list[tuple[str, str, str]]:
    return [(h.source, h.state, h.reason) for h in frozen.health if h.stamp_ns > 50 * MS]


def test_a_frozen_stream_is_unobserved_within_the_declared_time_and_ends_at_minimal_risk() -> None:
    frozen = run(FREEZE)
    lost = [h for h in frozen.health if h.state == "unobserved"]
    # the last value is measured at 395 ms, the samples come every 5 ms: 500 ms is the first that is over 100 ms later
    assert [(h.source, h.stamp_ns) for h in lost] == [("lean", 500 * MS)]
    assert "talos/body/lean is frozen" in lost[0].reason
    assert [(s, state) for s, state, _ in told(frozen)] == [("lean", "unobserved"), ("talos/body/lean", "stale")]
    assert frozen.max_level == ProtectionLevel.MINIMAL_RISK


def test_it_is_observed_again_once_the_values_move() -> None:
    states = [(h.source, h.state, h.stamp_ns) for h in run(LIFTED).health if h.stamp_ns > 600 * MS]
    assert states == [("lean", "ok", 700 * MS), ("talos/body/lean", "ok", 700 * MS)]


def test_a_moving_stream_decides_as_if_nobody_looked() -> None:
    assert run().digest == run(still_s=0.0).digest
    assert told(run(FREEZE, still_s=0.0)) == []


def test_a_replay_freezes_at_the_same_tick(tmp_path: Any) -> None:
    path = tmp_path / "run.mcap"
    config = {"supervisor": {"period_s": 0.01}, "detectors": [{"use": "lean", "config": {"threshold": 0.05}}]}
    config["policies"] = [{"use": "paper-gate"}]
    journal = McapJournal(path, Head(config, "", 0, 0))
    frozen = run(LIFTED, arm="on", journals=[journal])
    journal.close()
    again = replay(path, registry(STILL_S))
    assert again.agrees
    assert again.replayed == frozen.digest
    assert replay(path, registry(0.0)).replayed != frozen.digest


def test_a_configuration_may_allow_more_or_switch_it_off() -> None:
    longer = run(FREEZE, entry={"standstill_s": {"value": 0.3}})
    assert next(h.stamp_ns for h in longer.health if h.state == "unobserved") == 700 * MS
    assert told(run(FREEZE, entry={"standstill_s": {"value": 0.0}})) == []
    assert told(run(FREEZE, still_s=0.0, entry={"standstill_s": {"value": STILL_S}})) == told(run(FREEZE))


@pytest.mark.parametrize(
    ("setting", "says"),
    [({"valeu": 0.1}, "did you mean 'value'"), ({"value": -0.1}, "-0.1 is not a finite number at least 0")],
)
def test_a_standstill_that_is_none_is_refused(setting: dict[str, float], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        run(entry={"standstill_s": setting})


def test_a_spec_with_a_standstill_that_is_none_is_refused() -> None:
    base = threshold_spec("lean", "com-lateral-deviation", "body/lean")
    for channel, still_s in (("body/lean", -1.0), ("body/lean", float("nan")), ("*", 0.1)):
        inputs = (Input("value", channel, Scalar, max_standstill_s=still_s),)
        problems = [c.problem for c in spec_checks(msgspec.structs.replace(base, inputs=inputs)) if not c.ok]
        assert any("max_standstill_s" in p for p in problems), (channel, still_s, problems)


class Kept:
    """A detector that keeps what it is given."""

    def __init__(self) -> None:
        self.given: list[Inputs] = []

    def reset(self, seed: int) -> None:
        self.given.clear()

    def update(self, now_ns: int, inputs: Inputs) -> list[Indication]:
        self.given.append(inputs)
        return []


def test_a_frozen_optional_input_is_left_out_and_so_are_its_new_samples() -> None:
    need = Input("value", "x", Scalar, required=False, max_standstill_s=STILL_S)
    kept = Kept()
    spec = DetectorSpec("kept", ("com-lateral-deviation",), (need,), lambda _: kept)
    contained = Contained(spec, kept, [need], builtin_taxonomy())
    view = ChannelView([need], [contained.pending["value"]])
    for k in range(1, 61):
        now = k * 10 * MS
        value = Scalar(float(min(k, 10)) if k <= 40 else float(k))
        assert view.take(Sample(now, "x", value, k, now), now)
        assert contained.tick(now, {"x": view}).state == "ok"
    seen = ["value" in given.latest for given in kept.given]
    # measured until 100 ms; the standstill exceeds 100 ms from 210 ms on, and 410 ms measures again
    assert seen == [True] * 20 + [False] * 20 + [True] * 20
    assert [bool(given.new["value"]) for given in kept.given] == seen


def test_the_shorter_of_two_standstills_marks_the_channel_and_each_reader_has_its_own() -> None:
    needs = [Input(name, "x", Scalar, max_standstill_s=s) for name, s in (("a", 0.1), ("b", 0.3), ("c", 0.0))]
    view = ChannelView(needs, [])
    lacking = []
    for k in range(1, 51):
        now = k * 10 * MS
        view.take(Sample(now, "x", Scalar(1.0), k, now), now)
        lacks = [bool(view.lacks(n, NS_PER_S, round(n.max_standstill_s * NS_PER_S), now, 0)) for n in needs]
        lacking.append((now // MS, lacks, bool(view.frozen())))
    assert next(t for t, lacks, _ in lacking if lacks[0]) == 120
    assert next(t for t, lacks, _ in lacking if lacks[1]) == 320
    assert not any(lacks[2] for _, lacks, _ in lacking)
    assert all(lacks[0] == frozen for _, lacks, frozen in lacking)


def test_an_old_sample_that_comes_late_does_not_move_a_frozen_stream() -> None:
    view = ChannelView([Input("a", "x", Scalar, max_standstill_s=STILL_S)], [])
    for k in range(1, 31):
        now = k * 10 * MS
        view.take(Sample(now, "x", Scalar(1.0), k, now), now)
        view.take(Sample(5 * MS, "x", Scalar(float(k)), 0, now), now)
    assert "frozen" in view.frozen()


ANN = HumanPose("ann", ())
STANDING = [
    (Scalar(1.0), Scalar(1.0), True),
    (Scalar(1.0), Scalar(float(np.nextafter(1.0, 2.0))), False),
    (Humans((ANN,)), Humans((ANN,)), True),
    (Humans(()), Humans(()), False),
    (Detections(()), Detections(()), False),
    (Heartbeat(7, 0.004), Heartbeat(7, 0.005), True),
    (Heartbeat(7, 0.004), Heartbeat(8, 0.004), False),
    (JointState(("a", "b"), np.zeros(2)), JointState(("a", "b"), np.zeros(2)), True),  # type: ignore[arg-type]
    (Imu((0.0, 0.0, 0.0, 1.0), (0.0,) * 3, (0.0,) * 3), Imu((0.0, 0.0, 0.0, 1.0), (0.0,) * 3, (0.0,) * 3), True),
]  # fmt: skip


@pytest.mark.parametrize(("before", "after", "still"), STANDING)
def test_what_stands_still(before: Any, after: Any, still: bool) -> None:
    assert stands_still(before, after) is still
