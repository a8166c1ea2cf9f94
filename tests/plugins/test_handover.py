"""The handover detector: early, late and given-up partners are found, slow pulls and waiting hands are not."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

import numpy as np
import pytest
from handover_stream import Handover

from foreshock.detector import Inputs
from foreshock.errors import ConfigError
from foreshock.records import Indication, Sample
from foreshock_detectors import handover
from foreshock_detectors.handover import HandoverConfig

SPEC = handover.foreshock_detectors()[0]
INPUTS = {i.channel: i.name for i in handover.inputs(HandoverConfig())}


def play(samples: Sequence[Sample], config: HandoverConfig | None = None) -> list[Indication]:
    """What it says, tick by tick."""
    detector, latest, said = SPEC.build(config or HandoverConfig()), {}, []
    for stamp, group in groupby(samples, key=lambda s: s.stamp_ns):
        new = {INPUTS[s.channel.partition("/")[2]]: (s,) for s in group}
        latest |= {name: sample for name, (sample,) in new.items()}
        said += detector.update(stamp, Inputs(dict(latest), new))
    return said


def onset_s(said: Sequence[Indication]) -> float | None:
    return next((i.stamp_ns / 1e9 for i in said if i.present), None)


def test_a_pull_long_before_the_plan_is_a_mismatch_by_their_difference() -> None:
    said = play(Handover(arrives=1.3, pulls=1.5).samples(2.5))
    first = next(i for i in said if i.present)
    assert 1.5 < first.stamp_ns / 1e9 < 1.7  # the pull passes 4 N after 0.04 s, and must last 0.04 s
    assert first.statistic == pytest.approx(3.0 - 1.54, abs=0.03)
    assert (first.kind, first.unit, first.threshold) == ("timing-mismatch", "s", 0.4)
    assert 0.0 < first.severity < 1.0


def test_it_is_over_once_the_robot_lets_go() -> None:
    said = play(Handover(arrives=1.3, pulls=1.5).samples(4.5))
    last = max(i.stamp_ns for i in said if i.present) / 1e9
    assert 3.0 <= last <= 3.0 + HandoverConfig().hold_s + 0.04


def test_a_partner_who_does_not_come_is_late() -> None:
    assert onset_s(play(Handover(arrives=99.0, pulls=99.0).samples(5.0))) == pytest.approx(3.4 + 0.4, abs=0.03)


def test_a_partner_who_comes_when_the_robot_has_given_up_is_later_still() -> None:
    said = play(Handover(give_up=4.6, arrives=4.7, pulls=4.8).samples(6.0))
    later = [i for i in said if i.present and i.stamp_ns / 1e9 > 5.0]
    assert later
    assert later[-1].statistic == pytest.approx(4.84 - 3.4, abs=0.04)


@pytest.mark.parametrize(
    "scene",
    [
        Handover(),
        Handover(arrives=3.3, pulls=3.5, pull_n=8.0, rise_s=2.0),  # a slow pull on time
        Handover(arrives=3.4, pulls=6.0),  # a hand that is there and waits
        Handover(arrives=1.5),  # a hand that comes early and waits for the plan
        Handover(arrives=2.6, pulls=2.75),  # early by less than both take to adapt
        Handover(arrives=1.3, pulls=1.5, pull_n=2.5),  # a touch
    ],
)
def test_look_alikes_are_none(scene: Handover) -> None:
    assert onset_s(play(scene.samples(6.0))) is None


def test_a_knock_of_one_sample_is_no_pull() -> None:
    samples = [
        Sample(s.stamp_ns, s.channel, type(s.value)((30.0, 0.0, -9.8), (0.0, 0.0, 0.0)), s.seq)
        if s.channel.endswith("wrench") and s.stamp_ns == 1_000_000_000
        else s
        for s in Handover().samples(2.0)
    ]
    assert onset_s(play(samples)) is None


def test_the_pull_of_a_tug_does_not_flicker() -> None:
    """A tug of 3 Hz that passes through zero is one pull."""
    scene = Handover(transfer=5.0, expected=5.4, arrives=1.3, pulls=1.5, pull_n=20.0)
    plain = scene.force
    scene.force = lambda t: plain(t) * (1.0 + 1.5 * np.sin(6 * np.pi * t))  # type: ignore[method-assign]
    verdicts = [i.present for i in play(scene.samples(4.5)) if i.stamp_ns > 1_700_000_000]
    assert all(verdicts)


def test_partners_who_scatter_around_the_plan_raise_no_alarm() -> None:
    """Deviation 0.1 s: beyond 0.4 s lie 6e-5 of them, of 500 handovers none (probability 0.97)."""
    rng = np.random.default_rng(11)
    for k, off in enumerate(rng.normal(0.0, 0.1, 500)):
        scene = Handover(transfer=1.0, expected=1.4, arrives=1.2 + off, pulls=1.4 + off)
        assert onset_s(play(scene.samples(2.2, seed=k))) is None


@pytest.mark.parametrize("lost", ["plan/handover", "right_wrist/wrench", "humans/pose"])
def test_without_a_channel_it_says_nothing(lost: str) -> None:
    assert play([s for s in Handover(arrives=1.3, pulls=1.5).samples(3.0) if not s.channel.endswith(lost)]) == []


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"mismatch_s": 0.0}, "mismatch_s: must be finite and positive, not 0.0"),
        ({"during": (0,)}, "must be different phases"),
        ({"axis": (0.0, 0.0, 0.0)}, "no direction"),
        ({"pull_release_n": 4.0}, "not below pull_n"),
        ({"full_s": 0.3}, "not above the threshold"),
    ],
)
def test_bad_settings_are_refused(settings: dict[str, object], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        HandoverConfig(**settings)  # type: ignore[arg-type]
