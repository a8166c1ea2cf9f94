"""Labelled moments against cases worked by hand, and against the evidence window that runs."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from foreshock import evidence as ev
from foreshock.calibration import features, fit, landmarks, lifts, predict, reliability
from foreshock.calibration.features import Features
from foreshock.calibration.nominal import read_nominal, write_nominal
from foreshock.errors import BadInputError
from foreshock.events.schema import Event, EventPrecursor
from foreshock.records import Indication


def event(
    *precursors: EventPrecursor, outcome: str = "none", at: float | None = None, id_: str = "e", **more: str
) -> Event:
    return Event(id_, "assembly", "", "", "", ("kinematic",), precursors, "", outcome, at, 5.0, "x", **more)


SLIP, TORSO, COM = "foot-micro-slip", "torso-angular-spike", "com-lateral-deviation"


def test_labels_and_censoring() -> None:
    e = event(EventPrecursor(SLIP, 1.0), outcome="A1", at=2.0)
    found = {round(x.t_s, 1): x.accident for x in landmarks([e], 1.5, 0.5)}
    # up to 1.5 s nothing comes within 0.5 s; from then on it does; after 2 s there is nothing left to predict
    assert found == {round(0.1 * k, 1): 0.1 * k >= 1.5 - 1e-9 for k in range(20)}
    calm = landmarks([event(EventPrecursor(SLIP, 1.0))], 1.5, 0.5)
    assert max(x.t_s for x in calm) == pytest.approx(4.5)  # later ones run beyond what was observed
    assert not any(x.accident for x in calm)
    other = landmarks([e], 1.5, 0.5, mode="A2")
    assert not any(x.accident for x in other)
    assert max(x.t_s for x in other) == pytest.approx(1.5)


def test_treated_runs_are_refused() -> None:
    with pytest.raises(BadInputError, match="treated"):
        landmarks([event(source="treated")], 1.5, 0.5)


def test_the_window_is_that_of_the_running_evidence() -> None:
    """Two stretches of one kind and one of another, tick by tick through foreshock.evidence."""
    e = event(EventPrecursor(SLIP, 0.3, 0.8, 0.4), EventPrecursor(SLIP, 1.1, 3.2, 0.9), EventPrecursor(TORSO, 0.9, 1.0))
    state, window, tick = ev.Evidence(), ev.Window(), 10_000_000
    seen = {round(x.t_s, 2): x for x in landmarks([e], 1.5, 0.5, every_s=0.1)}
    compared = 0
    for k in range(451):
        now = k * tick
        said = {
            (kind, "", "d"): Indication(
                kind,
                "",
                now,
                any(p.kind == kind and p.onset_s <= now / 1e9 + 1e-9 <= p.end_s + 1e-9 for p in e.precursors),
                1.0,
                1.0,
                "1",
            )
            for kind in (SLIP, TORSO)
        }
        state, precursors = ev.step(state, window, now, said)
        x = seen.get(round(now / 1e9, 2)) if k % 10 == 0 else None
        # at the very edge of the window the two differ by the length of a tick
        edges = [p.end_s + 1.5 for p in e.precursors] + [p.onset_s + 1.5 for p in e.precursors]
        if x is None or any(abs(now / 1e9 - edge) < 0.011 for edge in edges):
            continue
        assert [(s.kind, float(s.occurrences)) for s in x.seen] == sorted((p.kind, p.occurrences) for p in precursors)
        compared += 1
    assert compared > 30


def test_predictions_are_eq_1() -> None:
    x = Features(
        np.array([1.0, 2.0, 3.0, 0.0]), np.array([1.0, 2.0, 3.0, 0.0]), np.zeros(4), np.zeros(4), np.zeros(4, np.int64)
    )
    assert predict(x, 1.6, 2.0, 1.2, 0.0) == pytest.approx([0.1174, 0.4546, 0.8093, 0.0], abs=1e-4)


def test_a_fit_needs_both_outcomes() -> None:
    with pytest.raises(BadInputError, match="some before an accident and some without one"):
        fit(features(landmarks([event(EventPrecursor(SLIP, 1.0))], 1.5, 0.5), {}, {}))


def test_lift_of_an_order_that_always_holds() -> None:
    pairs = [(EventPrecursor(SLIP, 0.1), EventPrecursor(TORSO, 0.5)) for _ in range(20)]
    alone = [(EventPrecursor(COM, 0.2),) for _ in range(20)]
    events = [event(*p, outcome="A1", at=2.0, id_=f"e{k}") for k, p in enumerate([*pairs, *alone])]
    (link,) = lifts(events)
    assert (link.first, link.then) == (SLIP, TORSO)
    # n = 20, expected 40 * 0.5 * 0.5 / 2 = 5, each shrunk by 2
    assert link.lift == pytest.approx(math.log(22.0 / 7.0))
    assert link.low <= link.lift <= link.high


def test_reliability_counts_every_moment_once() -> None:
    rng = np.random.default_rng(5)
    p = rng.uniform(0.0, 1.0, 3000)
    y = (rng.uniform(0.0, 1.0, 3000) < p).astype(float)
    bins = reliability(p, y)
    assert sum(b.n for b in bins) == 3000
    # calibrated by construction: a 95% interval misses the mean in few of ten bins
    assert sum(b.low <= b.predicted <= b.high for b in bins) >= 8


def test_nominal_statistics_come_back(tmp_path: Path) -> None:
    runs = [{SLIP: [0.1, 0.2], TORSO: [1.0, 2.0]}, {SLIP: [0.3], TORSO: [3.0]}]
    write_nominal(tmp_path / "n.parquet", runs)
    assert read_nominal(tmp_path / "n.parquet") == runs
    (tmp_path / "bad.parquet").write_text("no")
    with pytest.raises(BadInputError, match=r"bad\.parquet: cannot be read as Parquet"):
        read_nominal(tmp_path / "bad.parquet")
