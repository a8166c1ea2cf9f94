"""The co-carry detector: each kind on its definition, silent on its look-alikes, unobserved without its channel."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby, pairwise

import msgspec
import numpy as np
import pytest
from co_carry_stream import Carried

from foreshock.detector import Inputs
from foreshock.errors import ConfigError
from foreshock.messages import Odometry
from foreshock.records import Indication, Sample
from foreshock_detectors import co_carry
from foreshock_detectors.co_carry import CoCarryConfig
from foreshock_detectors.co_carry._lag import Lag

SPEC = co_carry.foreshock_detectors()[0]
SHARE, PHASE, DESYNC = SPEC.kinds
INPUTS = {i.channel: i.name for i in co_carry.inputs(CoCarryConfig())}


def play(samples: Sequence[Sample], config: CoCarryConfig | None = None) -> list[Indication]:
    """What it says, tick by tick."""
    detector, latest, said = SPEC.build(config or CoCarryConfig()), {}, []
    for stamp, group in groupby(samples, key=lambda s: s.stamp_ns):
        new = {INPUTS[s.channel.partition("/")[2]]: (s,) for s in group}
        latest |= {name: sample for name, (sample,) in new.items()}
        said += detector.update(stamp, Inputs(dict(latest), new))
    return said


def present(said: Sequence[Indication]) -> set[str]:
    return {i.kind for i in said if i.present}


def onset_s(said: Sequence[Indication], kind: str) -> float:
    return next((i.stamp_ns / 1e9 for i in said if i.kind == kind and i.present), math.inf)


def ramp(t: float, start: float, to: float, over: float = 1.0) -> float:
    """0 before start, to after start + over, linear between."""
    return to * min(max((t - start) / over, 0.0), 1.0)


def test_in_step_and_evenly_shared_is_none_for_ten_minutes() -> None:
    said = play(Carried(hz=1.75).samples(600.0, seed=3))
    assert present(said) == set()
    assert {i.kind for i in said} == {SHARE, PHASE, DESYNC}


def test_a_share_off_by_a_fifth_is_uneven_and_given_up_when_it_returns() -> None:
    said = play(Carried(share=lambda t: 0.5 + ramp(t, 5.0, 0.2) - ramp(t, 10.0, 0.2)).samples(15.0))
    assert present(said) == {SHARE}
    # 0.125 is passed at 5.63 s, two filters of 0.3 s later by 0.6 s
    assert 5.6 < onset_s(said, SHARE) < 6.4
    verdicts = [i.present for i in said if i.kind == SHARE]
    assert sum(a != b for a, b in pairwise(verdicts)) == 2
    assert not verdicts[-1]


def test_too_little_is_as_uneven_as_too_much() -> None:
    assert present(play(Carried(share=lambda t: 0.5 - ramp(t, 4.0, 0.2)).samples(8.0))) == {SHARE}


def test_a_planned_transfer_is_none() -> None:
    """The partner takes all of the load within half a second, as agreed."""
    given = lambda t: 0.5 - ramp(t, 5.0, 0.5, 0.5)  # noqa: E731
    said = play(Carried(share=given, agreed=given, swing=lambda t: 0.18 if t < 5.0 else 0.0).samples(9.0))
    assert SHARE not in present(said)


@pytest.mark.parametrize("lag", [1.5, -1.5, 3.0])
def test_ends_out_of_step_mismatch(lag: float) -> None:
    said = play(Carried(lag=lambda t: ramp(t, 5.0, lag, 1.5)).samples(10.0))
    assert present(said) == {PHASE}
    crossed = 5.0 + 1.5 * (math.pi / 3 - 0.1) / abs(lag)
    assert crossed - 0.3 < onset_s(said, PHASE) < crossed + 0.8


def test_a_quarter_of_the_threshold_more_or_less_decides() -> None:
    assert present(play(Carried(lag=lambda t: 0.75 * math.pi / 3).samples(30.0))) == set()
    assert present(play(Carried(lag=lambda t: 1.25 * math.pi / 3).samples(30.0))) == {PHASE}


@pytest.mark.parametrize(
    "scene",
    [
        Carried(common=lambda t: 0.4 * math.sin(2 * math.pi * 0.3 * t)),  # both raise and lower it together
        Carried(common=lambda t: 0.5 if 5.0 < t < 5.6 else 0.0),  # both accelerate together
        Carried(swing=lambda t: 0.18 + ramp(t, 5.0, 0.1), hz=2.1),  # both walk faster and harder
        Carried(partner=0.4),  # one of them walks more softly
        Carried(lag=lambda t: 2.0, grip_lag=lambda t: 2.0, swing=lambda t: 0.0),  # both stand
    ],
)
def test_coordinated_motion_and_standing_are_none(scene: Carried) -> None:
    assert present(play(scene.samples(10.0))) == set()


def test_a_grip_that_swings_against_the_load_is_out_of_step() -> None:
    said = play(Carried(grip_lag=lambda t: ramp(t, 5.0, 2.0, 1.0)).samples(10.0))
    assert present(said) == {DESYNC}
    assert 5.3 < onset_s(said, DESYNC) < 6.5


def test_a_grip_that_does_not_swing_is_not_out_of_step() -> None:
    """A gripper that simply holds harder."""
    samples = []
    for s in Carried(grip_lag=lambda t: 2.0).samples(10.0):
        still = s.channel.endswith("gripper/state")
        value = type(s.value)(True, 200.0, s.value.tangential_force, 0.04, 200.0) if still else s.value
        samples.append(Sample(s.stamp_ns, s.channel, value, s.seq))
    assert DESYNC not in present(play(samples))


def test_the_load_may_be_turned_in_the_world() -> None:
    """The same motion, told in axes that are turned by half a turn about the vertical: the partner is at -x."""
    samples = []
    for s in Carried(lag=lambda t: ramp(t, 4.0, 1.8)).samples(8.0):
        v = s.value
        if isinstance(v, Odometry):
            v = Odometry(v.position, (0.0, 0.0, 1.0, 0.0), (-v.linear[0], 0.0, v.linear[2]), (0.0, -v.angular[1], 0.0))
        samples.append(Sample(s.stamp_ns, s.channel, v, s.seq))
    straight = play(Carried(lag=lambda t: ramp(t, 4.0, 1.8)).samples(8.0))
    assert onset_s(play(samples, CoCarryConfig(axis=(-1.0, 0.0, 0.0))), PHASE) == onset_s(straight, PHASE)


def test_a_load_whose_orientation_is_no_rotation_leaves_its_ends_unobserved() -> None:
    said = play(
        [
            msgspec.structs.replace(s, value=msgspec.structs.replace(s.value, orientation=(0.0, 0.0, 0.0, 0.0)))
            if isinstance(s.value, Odometry) and s.stamp_ns > 4_000_000_000
            else s
            for s in Carried().samples(6.0)
        ]
    )
    assert {i.kind for i in said if i.stamp_ns <= 4_000_000_000} == {SHARE, PHASE, DESYNC}
    assert {i.kind for i in said if i.stamp_ns > 4_000_000_000} == {SHARE, DESYNC}


@pytest.mark.parametrize(
    ("lost", "kind"),
    [("wrist/wrench", SHARE), ("plan/share", SHARE), ("load/odometry", PHASE), ("gripper/state", DESYNC)],
)
def test_without_its_channel_a_kind_is_unobserved_and_the_others_are_not(lost: str, kind: str) -> None:
    said = play([s for s in Carried().samples(4.0) if not s.channel.endswith(lost)])
    assert {i.kind for i in said} == {SHARE, PHASE, DESYNC} - {kind}


@pytest.mark.parametrize("phi", [-2.5, -1.0, -0.2, 0.4, 1.3, 3.0])
@pytest.mark.parametrize("hz", [1.2, 1.8, 2.4])
def test_lag_is_the_phase_of_two_sines(phi: float, hz: float) -> None:
    """On its mean, and at each instant but for the ripple that averages over tau leave.

    a b = A B / 2 (cos(phi) + cos(2 w t + phi)), of which <.> passes r = 1 / sqrt(1 + (2 w tau)^2) at 2 w; the other
    component has no ripple. A vector of length 1 that is moved by r along one axis turns by asin(r) at most.
    """
    lag, angles = Lag(CoCarryConfig()), []
    for k in range(600):
        x = 2 * math.pi * hz * k * 0.02
        lag.push(k * 20_000_000, math.cos(x), 0.3 * math.cos(x + phi))
        angles.append(lag.angle_rad)
    off = np.angle(np.exp(1j * (np.array(angles[300:]) - phi)))
    ripple = math.asin(1.0 / math.hypot(1.0, 4.0 * math.pi * hz * CoCarryConfig().phase_time_constant_s))
    assert np.abs(off).max() < ripple + 0.01
    assert abs(off.mean()) < 0.03


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"load_kg": -1.0}, "load_kg: must be finite and positive, not -1.0"),
        ({"share_full": 0.1}, "not below share_full"),
        ({"desync_rad": 4.0}, "not below pi"),
        ({"down": (0.0, 0.0, 0.0)}, "no direction"),
        ({"least_coherence": 1.0}, "not below 1"),
    ],
)
def test_bad_settings_are_refused(settings: dict[str, object], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        CoCarryConfig(**settings)  # type: ignore[arg-type]
