"""Data drawn from a known model: its parameters come back, and a planted common cause is seen."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pytest

from foreshock.calibration import Moments, compare, correlation, features, fit, landmarks
from foreshock.events.schema import Event, EventPrecursor

KINDS = ("foot-micro-slip", "torso-angular-spike", "sway-amplitude-increase", "grip-micro-slip", "visual-occlusion")
COMMON = KINDS[:3]
"""All three fire where one hidden sway is present."""
TRUTH = (1.4, 2.3, 0.9)
H = 1.0


def le(m: float, q: float, a: float, b: float, c: float) -> float:
    """Eq. 1, written out."""
    return (1.0 - math.exp(-c * q)) / (1.0 + math.exp(-a * (m - b)))


def drawn(n: int, seed: int, common_cause: bool, truth: Sequence[float] = TRUTH) -> list[Event]:
    """Events with one moment each: what lies in the window at the last onset decides by Eq. 1.

    With a common cause a hidden sway fires all three kinds of COMMON at once and is as dangerous as one kind.
    """
    rng = np.random.default_rng([0x74727574, seed])
    events = []
    for k in range(n):
        present = {kind for kind in KINDS if rng.random() < 0.4}
        sources = len(present)
        if common_cause:
            sway = rng.random() < 0.5
            present = {kind for kind in present if kind not in COMMON} | (set(COMMON) if sway else set())
            sources = len(present) - 2 * sway
        if not present:
            continue
        seen, q = [], 0
        for kind in sorted(present):
            onsets = 1 + int(rng.integers(0, 3)) if not common_cause else 1
            q += onsets
            seen += [EventPrecursor(kind, 2.0 - 0.01 * i, 2.0 - 0.01 * i + 0.005) for i in range(onsets)]
        p = le(sources, q if not common_cause else sources, *truth)
        hit = rng.random() < p
        at = 2.0 + H * float(rng.uniform(0.01, 0.99)) if hit else None
        events.append(
            Event(
                f"e{k}", "assembly", "", "", "", ("kinematic",), tuple(seen), "", "A1" if hit else "none", at, 4.0, "x"
            )
        )
    return events


def nominal(seed: int, common_cause: bool, runs: int = 8) -> list[Mapping[str, list[float]]]:
    """Statistics while nothing is wrong: noise, and the sway that three detectors share."""
    rng = np.random.default_rng([0x6E6F6D, seed])
    out = []
    for _ in range(runs):
        sway = rng.standard_normal(400)
        out.append(
            {
                kind: (
                    0.98 * sway + 0.2 * rng.standard_normal(400)
                    if common_cause and kind in COMMON
                    else rng.standard_normal(400)
                ).tolist()
                for kind in KINDS
            }
        )
    return out


def test_independent_data_give_a_b_c_back_within_their_intervals() -> None:
    moments = landmarks(drawn(4000, 1, False), 1.5, H, at="last-onset")
    found = fit(features(moments, {}, {}), lift=False)
    for name, true in zip("abc", TRUTH, strict=True):
        low, high = found.intervals[name]
        assert low <= true <= high, (name, found)
    # the intervals say something: b to a tenth or two
    assert found.intervals["b"][1] - found.intervals["b"][0] < 0.5


@pytest.mark.slow
def test_the_intervals_cover_as_often_as_they_say() -> None:
    """30 data sets, 3 parameters: at a true 95% fewer than 77 of 90 has a probability below 1e-4."""
    covered = 0
    for seed in range(100, 130):
        found = fit(features(landmarks(drawn(1500, seed, False), 1.5, H, at="last-onset"), {}, {}), lift=False)
        covered += sum(found.intervals[n][0] <= t <= found.intervals[n][1] for n, t in zip("abc", TRUTH, strict=True))
    assert covered >= 77


def test_r_is_found_where_a_common_cause_is_and_nowhere_else() -> None:
    pairs = {frozenset(p.kinds): p for p in correlation(nominal(3, True))}
    planted = 0.98**2 / (0.98**2 + 0.2**2)
    for a, b in ((0, 1), (0, 2), (1, 2)):
        pair = pairs[frozenset((COMMON[a], COMMON[b]))]
        assert pair.r == pytest.approx(planted, abs=0.05)  # Ledoit-Wolf shrinks it a little
        assert pair.low <= pair.r <= pair.high
    assert all(p.r < 0.1 for k, p in pairs.items() if not k <= set(COMMON))
    assert all(p.r < 0.1 for p in correlation(nominal(4, False)))


@pytest.mark.parametrize("common_cause", [True, False])
def test_the_correlated_model_predicts_better_where_there_is_a_common_cause(common_cause: bool) -> None:
    r = {p.kinds: p.r for p in correlation(nominal(8, common_cause))}
    moments = Moments(drawn(2500, 7, common_cause), H, "", r, at="last-onset")
    scores = {s.model: s for s in compare(moments, lambda _: {}, seed=9, windows=[1.5])[0]}
    correlated = scores["correlated LE, fitted"]
    if common_cause:
        assert correlated.high < 0.0  # better than the independent LE, interval included
    else:
        assert correlated.low <= 0.0 <= correlated.high or abs(correlated.difference) < 5e-4
    assert scores["LE, the paper's a, b, c"].brier >= min(s.brier for s in scores.values())
