"""The restart detector: each kind on its definition, silent on its nearest look-alike."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest
from restart_motion import MS, ramp, stream

from foreshock.detector import Inputs
from foreshock.errors import ConfigError
from foreshock.messages import JointState, Odometry
from foreshock.records import Indication, Sample
from foreshock_detectors import restart
from foreshock_detectors.restart import RestartConfig

SPEC = restart.foreshock_detectors()[0]
ABRUPT, UNEXPECTED, LATE, OVERSHOOT, MISMATCH = SPEC.kinds
NAMES = {"talos/joints/state": "motion", "talos/base/odometry": "motion", "talos/motion/command": "command",
         "talos/task/phase": "phase"}  # fmt: skip
History = list[tuple[float, dict[str, Indication]]]


def play(samples: Sequence[Sample], config: RestartConfig | None = None) -> History:
    """Deliver by arrival to a detector that ticks every 10 ms."""
    detector = SPEC.build(config or RestartConfig())
    latest: dict[str, Sample] = {}
    out, k, now = [], 0, 0
    while k < len(samples):
        now += 10 * MS
        new: dict[str, list[Sample]] = {}
        while k < len(samples) and samples[k].received_ns <= now:
            name = NAMES[samples[k].channel]
            latest[name] = samples[k]
            new.setdefault(name, []).append(samples[k])
            k += 1
        out.append((now * 1e-9, {i.kind: i for i in detector.update(now, Inputs(dict(latest), new))}))
    return out


def present(history: History) -> set[str]:
    return {kind for _, said in history for kind, i in said.items() if i.present}


def first(history: History, kind: str) -> float:
    return next(t for t, said in history if kind in said and said[kind].present)


def still(t: float) -> tuple[int, float]:
    return (1, 100.0)


def never(t: float) -> bool:
    return False


# --- starts


@pytest.mark.parametrize("seed", range(5))
def test_a_start_that_nobody_permits_is_unexpected_and_if_steep_abrupt(seed: int) -> None:
    history = play(stream(lambda t: ramp(t, 2.0, 3.0, 0.6), lambda t: 0.0, 3.0, enabled=never, phase=still, seed=seed))
    assert {ABRUPT, UNEXPECTED} <= present(history)
    # 0.06 m/s are reached after 20 ms; two samples, their latency and a tick come on top.
    assert first(history, UNEXPECTED) == pytest.approx(2.04, abs=0.021)
    assert first(history, ABRUPT) < 2.12


def test_a_permitted_start_of_the_same_steepness_is_neither() -> None:
    def speed(t: float) -> float:
        return ramp(t, 2.05, 3.0, 0.6)

    history = play(stream(speed, lambda t: ramp(t, 2.0, 3.0, 0.6), 3.5, phase=lambda t: (int(t < 2.0), 2.0 - t)))
    assert present(history) == set()


def test_a_start_twice_as_steep_as_its_command_is_abrupt_but_not_unexpected() -> None:
    found = present(play(stream(lambda t: ramp(t, 2.0, 6.0, 0.5), lambda t: ramp(t, 2.0, 3.0, 0.5), 3.5)))
    assert ABRUPT in found
    assert UNEXPECTED not in found


def test_a_slow_creep_that_nobody_permits_is_unexpected_but_not_abrupt() -> None:
    found = present(play(stream(lambda t: ramp(t, 2.0, 0.4, 0.2), lambda t: 0.0, 3.5, enabled=never)))
    assert UNEXPECTED in found
    assert ABRUPT not in found


def test_permission_without_a_commanded_motion_permits_none() -> None:
    assert UNEXPECTED in present(play(stream(lambda t: ramp(t, 2.0, 1.0, 0.3), lambda t: 0.0, 3.0)))


def test_one_spike_of_a_resting_encoder_is_no_start() -> None:
    history = play(stream(lambda t: 0.5 if abs(t - 2.0) < 0.004 else 0.0, lambda t: 0.0, 3.0, enabled=never))
    assert present(history) == set()


def test_an_unexpected_restart_ends_with_the_motion() -> None:
    def speed(t: float) -> float:
        return 0.3 if 2.0 <= t < 2.6 else 0.0

    history = play(stream(speed, lambda t: 0.0, 4.0, enabled=never))
    ends = max(t for t, said in history if said and said[UNEXPECTED].present)
    assert 2.6 + 0.15 <= ends < 2.6 + 0.15 + 0.25 + 0.05  # a rest, then the hold


# --- stops


def braking(t: float, stop_s: float) -> float:
    """0.5 m/s until 2 s, then linearly to 0 within stop_s."""
    return 0.5 * min(1.0, max(0.0, 1.0 - (t - 2.0) / stop_s))


@pytest.mark.parametrize(("stop_s", "found"), [(0.27, set()), (0.5, {LATE}), (1.0, {LATE, MISMATCH})])
def test_a_stop_is_delayed_beyond_the_specified_time_only(stop_s: float, found: set[str]) -> None:
    """A stop off its plan by more than 0.2 s beyond that time is a mismatch as well."""
    samples = stream(
        lambda t: braking(t, stop_s), lambda t: 0.5 if t < 2.0 else 0.0, 5.0, stop=lambda t: t >= 2.0,
        phase=lambda t: (int(t >= 2.0), 2.0 - t if t < 2.0 else 100.0),
    )  # fmt: skip
    history = play(samples)
    assert present(history) == found
    if LATE in found:
        assert first(history, LATE) == pytest.approx(2.31, abs=0.03)
        assert not history[-1][1][LATE].present


def test_a_motion_long_after_a_stop_in_time_is_a_restart_and_no_delayed_stop() -> None:
    def speed(t: float) -> float:
        return braking(t, 0.2) if t < 3.0 else ramp(t, 3.0, 2.0, 0.3)

    history = play(stream(speed, lambda t: 0.5 if t < 2.0 else 0.0, 4.0, stop=lambda t: t >= 2.0))
    assert LATE not in present(history)
    assert UNEXPECTED in present(history)


def test_turning_round_is_no_standstill() -> None:
    """A reversal passes through 0 within 20 ms: the stop has not been reached."""

    def speed(t: float) -> float:
        return 0.5 if t < 2.0 else 0.3 * abs(math.cos(6.0 * (t - 2.0)))

    history = play(stream(speed, lambda t: 0.5 if t < 2.0 else 0.0, 4.0, stop=lambda t: t >= 2.0))
    assert LATE in present(history)
    assert UNEXPECTED not in present(history)


# --- after a start


@pytest.mark.parametrize(("excess", "found"), [(0.08, False), (0.2, True)])
def test_overshoot_is_speed_beyond_the_command_by_a_margin(excess: float, found: bool) -> None:
    def speed(t: float) -> float:
        return ramp(t, 2.0, 1.0, 0.4) + (excess if 2.5 < t < 2.8 else 0.0)

    history = play(stream(speed, lambda t: ramp(t, 2.0, 1.0, 0.4), 4.0))
    assert (OVERSHOOT in present(history)) is found
    if found:
        worst = max(said[OVERSHOOT].statistic for _, said in history if said and said[OVERSHOOT].present)
        assert worst == pytest.approx(excess, abs=0.02)


def test_braking_behind_a_falling_command_is_no_overshoot() -> None:
    """The robot follows 0.1 s late: it is as fast as it was told to be within the lag."""

    def command(t: float) -> float:
        return ramp(t, 2.0, 1.5, 0.6) if t < 2.8 else max(0.0, 0.6 - 3.0 * (t - 2.8))

    assert OVERSHOOT not in present(play(stream(lambda t: command(t - 0.1), command, 4.0)))


# --- timing


@pytest.mark.parametrize(("start_s", "found"), [(2.4, True), (2.9, False), (3.1, False), (3.6, True)])
def test_a_start_off_its_plan_by_more_than_a_reaction_time_is_a_mismatch(start_s: float, found: bool) -> None:
    """Planned at 3 s. It is commanded when it starts: what is wrong is the time alone."""
    samples = stream(
        lambda t: ramp(t, start_s, 1.0, 0.4), lambda t: ramp(t, start_s, 1.0, 0.4), 5.0,
        phase=lambda t: (1, 3.0 - t) if t < 3.0 else (0, 9.0 - t),
    )  # fmt: skip
    history = play(samples)
    assert present(history) == ({MISMATCH} if found else set())
    if start_s == 2.4:
        early = max(said[MISMATCH].statistic for _, said in history if said and said[MISMATCH].present)
        assert early == pytest.approx(3.0 - (start_s + 0.06), abs=0.03)


# --- what is not there


def test_without_the_plan_nothing_is_said_of_timing_and_without_the_command_nothing_at_all() -> None:
    samples = stream(lambda t: 0.0, lambda t: 0.0, 1.0)
    assert all(MISMATCH not in said for _, said in play(samples))
    assert all(not said for _, said in play([s for s in samples if s.channel != "talos/motion/command"]))


def test_a_joint_that_is_not_measured_is_unobserved() -> None:
    other = RestartConfig(joint="arm_left_1_joint")
    assert all(not said for _, said in play(stream(lambda t: 1.0, lambda t: 0.0, 1.0), other))


def test_odometry_serves_as_well() -> None:
    def walk(sample: Sample) -> Sample:
        if not isinstance(sample.value, JointState):
            return sample
        v = (0.7 * sample.value.velocity[0], 0.0, 0.0)
        value = Odometry((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), v, (0.0, 0.0, 0.0))
        return Sample(sample.stamp_ns, "talos/base/odometry", value, sample.seq, sample.received_ns)

    samples = [walk(s) for s in stream(lambda t: ramp(t, 2.0, 3.0, 0.6), lambda t: 0.0, 3.0, enabled=never)]
    assert {ABRUPT, UNEXPECTED} <= present(play(samples, RestartConfig(motion="odometry")))


def test_ten_minutes_of_nominal_cycles_raise_nothing() -> None:
    """Permitted starts and stops every 4 s, followed 50 ms late with white noise."""

    def command(t: float) -> float:
        into = t % 4.0
        return max(0.0, min(0.5, 1.0 * (into - 1.0), 2.5 * (3.0 - into)))

    samples = stream(
        lambda t: command(t - 0.05), command, 600.0, enabled=lambda t: 0.9 <= t % 4.0 < 3.0,
        phase=lambda t: (0, 3.0 - t % 4.0) if 1.0 <= t % 4.0 < 3.0 else (1, (1.0 - t) % 4.0),
    )  # fmt: skip
    assert present(play(samples)) == set()


@pytest.mark.parametrize(
    ("wrong", "what"),
    [({"stopping_s": -1.0}, "stopping_s"), ({"standstill_m_s": 0.1}, "standstill_m_s"), ({"joint": ""}, "joint")],
)
def test_settings_that_make_no_sense_are_refused(wrong: dict[str, object], what: str) -> None:
    with pytest.raises(ConfigError, match=what):
        RestartConfig(**wrong)
