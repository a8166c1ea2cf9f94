"""P on a timeline, ticked only where evidence changes, against the real pipeline and the window's definition."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from foreshock_stage import MS, Scripted, detector, fresh, module, said
from hypothesis import given, settings
from hypothesis import strategies as st

from foreshock.config import Config, DetectorEntry
from foreshock.errors import ConfigError
from foreshock.evidence import Window
from foreshock.records import Decision
from foreshock.registry import Registry
from foreshock.risk import CorrelatedRisk, IndependentRisk, LogisticExponential, RiskSettings, load_parameters
from foreshock.sensitivity import Episode, Outcome, Timeline, outcome, timelines_of, trajectory
from foreshock.supervisor import Supervisor
from foreshock.taxonomy import builtin_taxonomy

TAXONOMY = builtin_taxonomy()
A1 = TAXONOMY.mode("A1").cascade
TICK = 20 * MS
START = 50
"""The pipeline's ticks before the timeline begins."""
RISKS = {
    "independent": IndependentRisk(LogisticExponential(), TAXONOMY),
    "correlated": CorrelatedRisk(load_parameters("table-3", Path(), TAXONOMY), TAXONOMY),
}


def at(o: Outcome, t: float) -> tuple[float, float]:
    """P and upper at a time, from the moments."""
    return next(((p, upper) for s, p, upper in reversed(o.steps) if s <= t + 1e-9), (0.0, 0.0))


def piped(timeline: Timeline, window: Window, model: str, ticks: int) -> list[Decision]:
    """Decisions of a whole supervisor, of which one scripted detector a kind says what the timeline says."""

    def script(kind: str) -> Scripted:
        def now(now_ns: int) -> list[object]:
            t = now_ns - START * TICK
            mine = [e for e in timeline.episodes if e.kind == kind]
            present = [e for e in mine if round(e.onset_s * 1e9) <= t <= round(e.end_s * 1e9)]
            return [said(kind, bool(present), now_ns, severity=present[0].severity if present else 0.0)]

        return Scripted(now)

    kinds = sorted({e.kind for e in timeline.episodes})
    plugins = {k: module([detector(k, [k], script(k))]) for k in kinds}
    entries = tuple(DetectorEntry(k) for k in kinds)
    config = Config(entries, window=window, risk=RiskSettings(model), policies=())  # type: ignore[arg-type]
    supervisor = Supervisor(config, registry=Registry(modules=plugins))
    supervisor.reset(0, 0)
    decisions = [supervisor.step([fresh(k * TICK)], k * TICK) for k in range(1, START + ticks)]
    supervisor.close()
    return decisions[START - 1 :]


@pytest.mark.parametrize("model", RISKS)
@pytest.mark.parametrize("window", [Window(), Window(0.5, 0.2), Window(0.9, 1.3)], ids=str)
@pytest.mark.parametrize("story", ["isolated", "cascade", "decay"])
def test_moments_give_what_the_real_pipeline_gives_on_a_grid(model: str, window: Window, story: str) -> None:
    timeline = next(t for t in timelines_of(A1) if t.id == story)
    o = outcome(timeline, trajectory(timeline, window), RISKS[model], 0.3)
    decisions = piped(timeline, window, model, ticks=300)
    for k, d in enumerate(decisions):
        # the same code on the same counts: only sums in another order could differ
        assert (d.risk.probability, d.risk.upper) == pytest.approx(at(o, k * 0.02), abs=1e-12), k
    below = [k * 0.02 for k, d in enumerate(decisions) if not d.trust.trust >= 0.3]
    assert o.opened is bool(below)
    assert o.gate_s == pytest.approx(below[0] if below else timeline.end_s, abs=1e-9)
    back = max(0.0, below[-1] + 0.02 - timeline.end_s) if below else 0.0
    assert o.recovery_s == pytest.approx(back, abs=1e-9)


def by_definition(timeline: Timeline, window: Window, t: int) -> tuple[int, int]:
    """m and q at t (in ticks), from the words of docs/model.md; shares no code with the evidence window."""
    length, recur = (round(x * 50) for x in (window.length_s, window.recurrence_s or window.length_s))
    m = q = 0
    for kind in A1:
        spans = [(round(e.onset_s * 50), round(e.end_s * 50)) for e in timeline.episodes if e.kind == kind]
        begun = [(onset, end) for onset, end in spans if onset <= t]
        if any(t < end + length for _, end in begun):
            m += 1
            occurrences = [x for onset, end in begun for x in range(onset, min(t, end) + 1, recur)]
            q += max(1, len([x for x in occurrences if x > t - length]))
    return m, q


TICKS = st.integers(0, 120)


@st.composite
def stories(draw: st.DrawFn) -> Timeline:
    episodes = []
    for kind in A1:
        times = sorted(draw(st.lists(TICKS, min_size=0, max_size=4, unique=True)))
        pairs = zip(times[::2], times[1::2], strict=False)
        episodes += [Episode(kind, a / 50, b / 50, 0.5) for a, b in pairs]
    return Timeline("drawn", "drawn", tuple(episodes) or (Episode(A1[0], 0.0, 1.0),))


@settings(max_examples=60)
@given(stories(), st.integers(5, 100), st.integers(5, 100))
def test_independent_p_is_eq_1_on_counts_by_definition(timeline: Timeline, length: int, recur: int) -> None:
    window = Window(length / 50, recur / 50)
    o = outcome(timeline, trajectory(timeline, window), RISKS["independent"], 0.3)
    start = round(timeline.onsets_s[0] * 50)
    for t in range(start, 240):
        m, q = by_definition(timeline, window, t)
        expected = (1.0 - math.exp(-1.2 * q)) / (1.0 + math.exp(-1.6 * (m - 2.0))) if m else 0.0
        assert at(o, (t - start) / 50)[0] == pytest.approx(expected, abs=1e-12), t


def test_a_timeline_is_checked() -> None:
    slip = Episode(A1[0], 0.0, 1.0)
    with pytest.raises(ConfigError, match="begins before it has ended"):
        Timeline("x", "x", (slip, Episode(A1[0], 1.0, 2.0)))
    with pytest.raises(ConfigError, match="no episodes"):
        Timeline("x", "x", ())
    with pytest.raises(ConfigError, match="end_s"):
        Episode(A1[0], 1.0, 1.0)
    with pytest.raises(ConfigError, match="severity"):
        Episode(A1[0], 1.0, 2.0, 1.1)
