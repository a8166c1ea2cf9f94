"""Window, scale of R and presence from data that were drawn with known ones."""

from __future__ import annotations

import math
from collections.abc import Callable

import msgspec
import numpy as np
import pytest

from foreshock.calibration import Moments, calibrate, compare, landmarks, scaled
from foreshock.calibration.profile import WINDOWS_S, Surface, axes
from foreshock.events.schema import Event, EventPrecursor
from foreshock.risk import Pair

KINDS = ("foot-micro-slip", "torso-angular-spike", "sway-amplitude-increase", "grip-micro-slip", "visual-occlusion")
COMMON = KINDS[:3]
A, B, C = 1.6, 2.2, 0.9
H, NOW = 1.0, 6.0
PAIRS = {(COMMON[0], COMMON[1]): 0.9, (COMMON[0], COMMON[2]): 0.9, (COMMON[1], COMMON[2]): 0.9}
Seen = list[tuple[str, float, float]]
"""Kind, age in s, severity."""


def le(m: float, q: float) -> float:
    """Eq. 1, written out."""
    return (1.0 - math.exp(-C * q)) / (1.0 + math.exp(-A * (m - B)))


def drawn(n: int, seed: int, probability: Callable[[Seen], float], oldest_s: float) -> list[Event]:
    """Events with momentary precursors of random age and severity, judged at NOW, when the last of them begins."""
    rng = np.random.default_rng([0x70726F66, seed])
    events = []
    for k in range(n):
        kinds = [kind for kind in KINDS if rng.random() < 0.6] or [KINDS[0]]
        seen = [(kind, float(rng.uniform(0.0, oldest_s)), float(rng.uniform())) for kind in kinds]
        newest = int(rng.integers(len(seen)))
        seen[newest] = (seen[newest][0], 0.0, seen[newest][2])
        at = NOW + H * float(rng.uniform(0.01, 0.99)) if rng.random() < probability(seen) else None
        precursors = tuple(EventPrecursor(kind, NOW - age, NOW - age, s) for kind, age, s in seen)
        outcome = "none" if at is None else "A1"
        events.append(Event(f"e{k}", "assembly", "", "", "", (), precursors, "", outcome, at, NOW + 2.0 * H, "x"))
    return events


def through(window_s: float) -> Callable[[Seen], float]:
    """Truth: what is older than the window does not count."""

    def probability(seen: Seen) -> float:
        n = sum(age < window_s for _, age, _ in seen)
        return le(n, n)

    return probability


def correlated(rho: float) -> Callable[[Seen], float]:
    """Truth: k kinds of equal correlation r are k / (1 + (k - 1) r) independent ones."""

    def probability(seen: Seen) -> float:
        k = sum(kind in COMMON for kind, _, _ in seen)
        m = (k / (1.0 + (k - 1) * 0.9 * rho) if k else 0.0) + len(seen) - k
        return le(m, m)

    return probability


def graded(presence: float) -> Callable[[Seen], float]:
    """Truth: a precursor of severity 0 has strength presence, one of severity 1 has strength 1."""
    return lambda seen: le(sum(presence + (1.0 - presence) * s for _, _, s in seen), len(seen))


def full(events: list[Event]) -> list[Event]:
    """The same events, every severity 1."""
    return [
        msgspec.structs.replace(e, precursors=tuple(EventPrecursor(p.kind, p.onset_s, p.end_s) for p in e.precursors))
        for e in events
    ]


@pytest.mark.parametrize(("truth", "seed"), [(0.8, 1), (2.2, 2)])
def test_the_window_comes_back_within_its_interval(truth: float, seed: int) -> None:
    found = calibrate(Moments(full(drawn(1500, seed, through(truth), 4.0)), H, at="last-onset"), {})
    p = found.profiles["window_s"]
    assert set(found.profiles) == {"window_s"}  # nothing correlates, severities do not differ
    assert p.low <= truth <= p.high, p
    assert p.high - p.low < 0.6
    assert (found.window_s, found.rho, found.presence) == (p.best, 1.0, 1.0)
    for name, true in (("a", A), ("b", B), ("c", C)):
        assert found.fitted.intervals[name][0] <= true <= found.fitted.intervals[name][1], (name, found.fitted)


@pytest.mark.parametrize(("truth", "seed"), [(0.0, 3), (0.5, 4), (1.0, 5)])
def test_rho_comes_back_within_its_interval(truth: float, seed: int) -> None:
    events = full(drawn(2500, seed, correlated(truth), 0.5))
    found = calibrate(Moments(events, H, "", PAIRS, at="last-onset"), {}, [1.5])
    p = found.profiles["rho"]
    assert set(found.profiles) == {"rho"}  # the window was given
    assert p.low <= truth <= p.high, p
    assert p.high - p.low < 0.7
    assert min(d for _, d in p.curve) == 0.0
    assert dict(p.curve)[p.best] == 0.0


@pytest.mark.parametrize(("truth", "seed"), [(0.2, 6), (0.7, 7)])
def test_presence_comes_back_within_its_interval(truth: float, seed: int) -> None:
    found = calibrate(Moments(drawn(2500, seed, graded(truth), 0.5), H, at="last-onset"), {}, [1.5])
    p = found.profiles["presence"]
    assert set(found.profiles) == {"presence"}
    assert p.low <= truth <= p.high, p
    assert p.high - p.low < 0.5


def test_two_of_them_at_once() -> None:
    def probability(seen: Seen) -> float:
        inside = [s for _, age, s in seen if age < 1.2]
        return le(sum(0.4 + 0.6 * s for s in inside), len(inside))

    found = calibrate(Moments(drawn(2000, 8, probability, 4.0), H, at="last-onset"), {})
    for name, true in (("window_s", 1.2), ("presence", 0.4)):
        assert found.profiles[name].low <= true <= found.profiles[name].high, found.profiles[name]


@pytest.mark.slow
def test_the_intervals_cover_as_often_as_they_say() -> None:
    """8 sets for each of three: at a true 95% fewer than 17 of 24 has a probability below 1e-4."""
    covered = 0
    for seed in range(100, 108):
        window = calibrate(Moments(full(drawn(500, seed, through(1.7), 4.0)), H, at="last-onset"), {})
        rho = calibrate(Moments(full(drawn(800, seed, correlated(0.4), 0.5)), H, "", PAIRS, "last-onset"), {}, [1.5])
        presence = calibrate(Moments(drawn(800, seed, graded(0.5), 0.5), H, at="last-onset"), {}, [1.5])
        for found, name, true in ((window, "window_s", 1.7), (rho, "rho", 0.4), (presence, "presence", 0.5)):
            covered += found.profiles[name].low <= true <= found.profiles[name].high
    assert covered >= 17


def test_moments_that_repeat_do_not_narrow_the_interval() -> None:
    """Every event four times under one group holds no more than once: D grows fourfold, and so does its limit."""
    events = full(drawn(600, 9, through(1.3), 4.0))
    again = [msgspec.structs.replace(e, id=f"{e.id}-{k}", group=e.group) for e in events for k in range(4)]
    once = calibrate(Moments(events, H, at="last-onset"), {}, [0.5, 0.8, 1.0, 1.2, 1.4, 1.6, 2.0, 2.5])
    four = calibrate(Moments(again, H, at="last-onset"), {}, [0.5, 0.8, 1.0, 1.2, 1.4, 1.6, 2.0, 2.5])
    one, more = once.profiles["window_s"], four.profiles["window_s"]
    assert one.effect < 1.5
    assert more.effect == pytest.approx(4.0 * one.effect, rel=0.25)  # the prior stays what it was
    assert more.high - more.low > 0.8 * (one.high - one.low)


def test_the_moments_of_every_window_are_the_same() -> None:
    events = drawn(50, 10, through(1.0), 4.0)
    moments = Moments(events, H)
    for w in WINDOWS_S:
        seen = moments.through(w)
        assert [x.accident for x in seen] == [bool(y) for y in moments.y]
        assert [(x.event, x.t_s) for x in seen] == [(x.event, x.t_s) for x in moments.through(1.5)]


def test_an_accident_without_evidence_costs_a_window_that_forgot() -> None:
    """Accidents 1 s after a lone precursor: through 0.5 s nothing tells them from calm moments."""
    seen = (EventPrecursor(KINDS[0], 1.0, 1.0),)
    struck = [Event(f"a{k}", "assembly", "", "", "", (), seen, "", "A1", 2.4, 3.0, "x") for k in range(40)]
    calm = [Event(f"n{k}", "assembly", "", "", "", (), (), "", "none", None, 3.0, "x") for k in range(40)]
    surface = Surface(Moments([*struck, *calm], 0.3), {})
    assert surface.at((1.5, 1.0, 1.0)).loss < surface.at((0.5, 1.0, 1.0)).loss - 50.0


def test_a_severity_counts_once_its_stretch_is_over() -> None:
    e = Event("e", "assembly", "", "", "", (), (EventPrecursor(KINDS[0], 1.0, 2.0, 0.3),), "", "none", None, 5.0, "x")
    seen = {round(x.t_s, 1): x.seen[0].severity for x in landmarks([e], 1.5, 0.5) if x.seen}
    assert {t: s for t, s in seen.items() if t < 1.95} == {round(1.0 + 0.1 * k, 1): 1.0 for k in range(10)}
    assert {s for t, s in seen.items() if t > 1.95} == {0.3}


def test_only_given_windows_are_chosen_from() -> None:
    moments = Moments(full(drawn(400, 11, through(1.0), 4.0)), H, at="last-onset")
    assert axes(moments, [2.0, 1.0]) == ((1.0, 2.0), (1.0,), (1.0,))
    some = calibrate(moments, {}, [1.0, 2.5])
    assert some.window_s == 1.0
    assert [v for v, _ in some.profiles["window_s"].curve] == [1.0, 2.5]
    assert calibrate(moments, {}, [2.0]).profiles == {}


def test_a_fold_never_sees_its_own_labels() -> None:
    """An event's own outcome, turned round, changes no prediction of its own."""
    events = drawn(200, 12, through(1.0), 4.0)
    k = next(k for k, e in enumerate(events) if not e.accident)
    turned = [*events[:k], msgspec.structs.replace(events[k], outcome="A1", outcome_s=NOW + 0.5), *events[k + 1 :]]
    said = [compare(Moments(e, H, "", PAIRS, at="last-onset"), lambda _: {}, seed=1)[1:] for e in (events, turned)]
    (one, y), (two, z) = said
    assert list(np.flatnonzero(y != z)) == [k]
    for name, p in one.items():
        assert p[k] == two[name][k], name


def test_r_is_scaled_off_its_diagonal_with_its_interval() -> None:
    (pair,) = scaled([Pair((KINDS[0], KINDS[1]), 0.8, 0.6, 0.9)], 0.5, 0.25, 1.0)
    assert (pair.r, pair.low, pair.high) == pytest.approx((0.4, 0.15, 0.9))
