"""The evidence window against a brute-force reading of the raw history, and its phases one by one."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foreshock.errors import ConfigError
from foreshock.evidence import Evidence, Window, step
from foreshock.records import Indication, Precursor, SampleRef

MS = 1_000_000
KIND = "foot-micro-slip"
Verdict = Literal["present", "absent", "lost", "silent"]
SEVERITY_HOLD_NS = 100 * MS
"""The window's maximum may be kept up to this much longer, never shorter."""


@dataclass
class Word:
    """What one detector said of one subject in one tick."""

    now_ns: int
    verdict: Verdict
    severity: float


def indication(present: bool, stamp_ns: int, severity: float, subject: str = "", kind: str = KIND) -> Indication:
    return Indication(kind, subject, stamp_ns, present, 1.0, 0.5, "1", severity, (SampleRef("talos/x", stamp_ns),))


@dataclass
class Truth:
    """What the specification gives for one detector: counted or not, phase, q, weight, severity bounds, onset."""

    counted: bool
    phase: str = ""
    q: float = 0.0
    weight: float = 0.0
    severity: tuple[float, float] = (0.0, 0.0)
    onset_ns: int = 0
    frozen: bool = False


def brute_force(words: list[Word], latency_ns: int, window: Window) -> Truth:
    """Reads the whole history anew: no state is carried from tick to tick.

    The clock of the evidence stands still from the first tick of a loss to the next observation. An occurrence is an
    onset, or a full recurrence period inside a stretch of presence; it counts for ``t in (now - span, now]``.
    """
    length = round(window.length_s * 1e9)
    span = length * (5 if window.kernel == "exponential" else 1)
    recur = round((window.recurrence_s or window.length_s) * 1e9)
    clock: list[int] = []
    stopped, lost_since = 0, -1
    for w in words:
        if w.verdict in ("lost", "silent"):
            lost_since = w.now_ns if lost_since < 0 else lost_since
            clock.append(lost_since - stopped)
        else:
            if lost_since >= 0:
                stopped, lost_since = stopped + w.now_ns - lost_since, -1
            clock.append(w.now_ns - stopped)
    now = clock[-1]
    stretches: list[tuple[int, int, int]] = []  # onset (clock), onset (source), last present (clock)
    present, was_present = False, False
    seen_at: list[tuple[int, float]] = []
    for w, t in zip(words, clock, strict=True):
        was_present = present
        if w.verdict == "present":
            if not present:
                stretches.append((t - latency_ns, w.now_ns - latency_ns, t))
            stretches[-1] = (*stretches[-1][:2], t)
            seen_at.append((t, w.severity))
        present = present if w.verdict in ("lost", "silent") else w.verdict == "present"
    if not stretches or (not present and stretches[-1][2] <= now - span):
        return Truth(False)
    live = [s for s in stretches if s[2] > now - span] or stretches[-1:]
    occurrences = [
        s[0] + n * recur for s in stretches for n in range((s[2] - s[0]) // recur + 1) if s[0] + n * recur > now - span
    ]
    frozen = words[-1].verdict in ("lost", "silent")
    phase = "cleared" if not present else "onset" if not was_present and not frozen else "ongoing"
    if window.kernel == "boxcar":
        weight, q = 1.0, float(max(1, len(occurrences)))
    else:
        weight = 1.0 if present else math.exp(-(now - stretches[-1][2]) / length)
        q = max(weight, sum(math.exp(-(now - t) / length) for t in occurrences))
    least = max((s for t, s in seen_at if t > now - span), default=0.0)
    most = max((s for t, s in seen_at if t > now - span - SEVERITY_HOLD_NS), default=1.0)
    if present and seen_at[-1][0] <= now - span:
        least, most = seen_at[-1][1], max(most, seen_at[-1][1])
    return Truth(True, phase, q, weight, (least, most), live[0][1], frozen)


GAPS = st.integers(1, 40).map(lambda n: n * 10 * MS)
VERDICTS = st.sampled_from(["present", "present", "absent", "absent", "lost", "silent"])


@st.composite
def histories(draw: st.DrawFn) -> tuple[list[int], dict[str, tuple[int, list[Word]]]]:
    ticks, now = [], 0
    for gap in draw(st.lists(GAPS, min_size=1, max_size=25)):
        now += gap
        ticks.append(now)
    detectors = {}
    for name in draw(st.sampled_from([("a",), ("a", "b"), ("a", "b", "c")])):
        latency = draw(st.integers(0, 3)) * 3 * MS
        words = [Word(t, draw(VERDICTS), draw(st.sampled_from([0.0, 0.25, 0.5, 1.0]))) for t in ticks]
        detectors[name] = (latency, words)
    return ticks, detectors


WINDOWS = st.builds(
    Window,
    st.sampled_from([0.5, 1.0, 1.5]),
    st.sampled_from([0.0, 0.2, 0.7, 3.0]),
    st.sampled_from(["boxcar", "exponential"]),
)


@given(histories(), WINDOWS)
def test_agrees_with_brute_force(history: tuple[list[int], dict[str, tuple[int, list[Word]]]], window: Window) -> None:
    agree(*history, window)


SHORT = [Window(0.1), Window(0.25, 0.04), Window(0.25, 1.0), Window(0.05, 0.2, "exponential")]


@pytest.mark.parametrize("window", SHORT)
@pytest.mark.parametrize("seed", range(12))
def test_agrees_with_brute_force_at_a_tick_of_5_ms(seed: int, window: Window) -> None:
    """In most ticks nothing begins, recurs, expires or gets worse."""
    rng = random.Random(seed)
    ticks = [k * 5 * MS for k in range(1, 161)]
    detectors = {}
    for name in ("a", "b")[: 1 + seed % 2]:
        words: list[Word] = []
        while len(words) < len(ticks):
            verdict: Verdict = rng.choice(["present", "present", "absent", "lost"])
            stretch = ticks[len(words) : len(words) + rng.choice([2, 12, 60])]
            words += [Word(t, verdict, rng.choice([0.25] * 40 + [0.5, 1.0])) for t in stretch]
        detectors[name] = (rng.choice([0, 3, 9]) * MS, words)
    agree(ticks, detectors, window)


def agree(ticks: list[int], detectors: dict[str, tuple[int, list[Word]]], window: Window) -> None:
    evidence = Evidence()
    for k, now in enumerate(ticks):
        observed, lost = {}, []
        for name, (latency, words) in detectors.items():
            w = words[k]
            if w.verdict == "lost":
                lost.append(name)
            elif w.verdict != "silent":
                present = w.verdict == "present"
                observed[KIND, "", name] = indication(present, now - latency, w.severity if present else 0.0)
        evidence, found = step(evidence, window, now, observed, lost, observed)
        truths = {n: brute_force(ws[: k + 1], lat, window) for n, (lat, ws) in detectors.items()}
        counted = {n: t for n, t in truths.items() if t.counted}
        if not counted:
            assert found == ()
            continue
        (p,) = found
        # several detectors of one kind count once, by their maximum
        assert p.weight == pytest.approx(max(t.weight for t in counted.values()), abs=1e-12)
        assert p.occurrences == pytest.approx(max(t.q for t in counted.values()), abs=1e-9)
        assert max(t.severity[0] for t in counted.values()) <= p.severity
        assert p.severity <= max(t.severity[1] for t in counted.values())
        assert p.onset_ns == min(t.onset_ns for t in counted.values())
        assert p.frozen is all(t.frozen for t in counted.values())
        assert p.detector in counted
        phases = {t.phase for t in counted.values()}
        if "ongoing" in phases:
            assert p.phase == "ongoing"
        else:
            assert p.phase == ("onset" if "onset" in phases else "cleared")


def run(words: str, window: Window, period_ms: int = 100, severity: float = 1.0) -> list[tuple[Precursor, ...]]:
    """``+`` present, ``-`` absent, ``x`` lost, one letter per tick, from t = 0."""
    evidence, out = Evidence(), []
    for k, letter in enumerate(words):
        now = k * period_ms * MS
        observed = {} if letter == "x" else {(KIND, "", "d"): indication(letter == "+", now, severity)}
        evidence, found = step(evidence, window, now, observed, ["d"] if letter == "x" else [], observed)
        out.append(found)
    return out


def test_phases_and_expiry_by_the_tick_s_time() -> None:
    found = run("-++--------", Window(0.5))
    assert [f[0].phase if f else None for f in found[:4]] == [None, "onset", "ongoing", "cleared"]
    # last present at 0.2 s: inside the window of 0.5 s until, but not at, 0.7 s
    assert [bool(f) for f in found] == [False] + [True] * 6 + [False] * 4


def test_a_condition_that_persists_counts_once_more_per_recurrence_period() -> None:
    q = [f[0].occurrences for f in run("+" * 16, Window(1.5, 0.4))]
    # onset at 0; again at 0.4, 0.8, 1.2; at 1.5 the onset itself has left the window
    assert q == [1.0] * 4 + [2.0] * 4 + [3.0] * 4 + [4.0] * 3 + [3.0]


def test_recurrence_is_the_window_by_default() -> None:
    assert [f[0].occurrences for f in run("+" * 40, Window(1.5))] == [1.0] * 40


def test_each_onset_counts_one() -> None:
    assert run("+-+-+", Window(1.5))[-1][0].occurrences == 3.0


def test_a_persisting_condition_keeps_the_source_stamp_of_its_onset() -> None:
    """Order of a cascade is by onset: it must not turn round because the first condition outlasts the window."""
    assert {f[0].onset_ns for f in run("+" * 40, Window(1.5))} == {0}


def test_a_loss_does_not_shift_the_source_stamp_of_an_onset() -> None:
    assert {f[0].onset_ns for f in run("+" + "x" * 10 + "+-", Window(1.5))} == {0}


@pytest.mark.parametrize("kernel", ["boxcar", "exponential"])
def test_frozen_evidence_neither_fades_nor_expires_and_runs_on_afterwards(
    kernel: Literal["boxcar", "exponential"],
) -> None:
    window = Window(0.5, kernel=kernel)
    found = run("+-" + "x" * 100 + "-" * 40, window)
    at_loss = found[2][0]
    assert at_loss.frozen
    for f in found[2:102]:
        assert (f[0].weight, f[0].occurrences, f[0].severity) == (
            at_loss.weight,
            at_loss.occurrences,
            at_loss.severity,
        )
    without_loss = run("+-" + "-" * 41, window)
    assert [(f[0].weight, f[0].occurrences) if f else None for f in found[102:142]] == [
        (f[0].weight, f[0].occurrences) if f else None for f in without_loss[2:42]
    ]


def test_several_subjects_of_one_kind_count_each() -> None:
    observed = {(KIND, side, "d"): indication(True, 0, 1.0, side) for side in ("left", "right")}
    _, found = step(Evidence(), Window(), 0, observed, (), observed)
    assert [(p.kind, p.subject) for p in found] == [(KIND, "left"), (KIND, "right")]


def test_the_statistic_and_its_samples_are_those_of_the_strongest_detector() -> None:
    weak, strong = indication(True, 5, 0.2), indication(True, 7, 0.9)
    observed = {(KIND, "", "a"): weak, (KIND, "", "b"): strong}
    _, (p,) = step(Evidence(), Window(), 10, observed, (), observed)
    assert (p.detector, p.severity, p.evidence, p.onset_ns) == ("b", 0.9, strong.evidence, 5)


def test_a_detector_that_was_not_due_carries_its_verdict() -> None:
    """Present between two updates of a slow detector: the stretch goes on, and so do its recurrences."""
    carried = {(KIND, "", "d"): indication(True, 0, 1.0)}
    evidence, _ = step(Evidence(), Window(1.5, 0.4), 0, carried, (), carried)
    evidence, (p,) = step(evidence, Window(1.5, 0.4), 900 * MS, {}, (), carried)
    assert (p.phase, p.occurrences, p.frozen) == ("ongoing", 3.0, False)


@pytest.mark.parametrize(
    ("fields", "place"),
    [
        ({"length_s": 0.0}, "window.length_s"),
        ({"length_s": -1.5}, "window.length_s"),
        ({"length_s": math.nan}, "window.length_s"),
        ({"length_s": math.inf}, "window.length_s"),
        ({"recurrence_s": -1.0}, "window.recurrence_s"),
        ({"recurrence_s": 1e-10}, "window.recurrence_s"),
        ({"recurrence_s": math.nan}, "window.recurrence_s"),
    ],
)
def test_a_window_that_would_hide_evidence_or_never_end_is_refused(fields: dict[str, float], place: str) -> None:
    with pytest.raises(ConfigError, match=place):
        Window(**fields)
