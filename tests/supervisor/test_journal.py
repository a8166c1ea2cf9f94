"""The digest changes with every field of a decision, and with nothing else."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import pytest
from foreshock_stage import MS, SLIP, detector, fresh, play, said, stage

from foreshock.journal import DigestJournal, MemoryJournal, OperatorReset
from foreshock.records import Decision, Health, Indication, Intervention, ProtectionLevel, SampleRef

SPEC = detector("d", [SLIP], lambda now: [said(SLIP, True, now)])


def decision() -> Decision:
    (d,) = play(stage(SPEC), 1)
    return d


def digest(*decisions: Decision) -> str:
    journal = DigestJournal()
    for d in decisions:
        journal.tick((), d)
    journal.close()
    return journal.digest


CHANGES: dict[str, Any] = {
    "now_ns": 1,
    "tick": 9,
    "precursors": (),
    "level": ProtectionLevel.CAUTION,
    "levels": {},
    "interventions": (Intervention(0, "balance-lock", 1.0),),
    "changes": (Intervention(0, "balance-lock", 1.0),),
    "health": (Health(0, "d", "failed"),),
    "motion_permitted": False,
    "time_to_event_s": 0.5,
    "indications": (),
}


@pytest.mark.parametrize("field", CHANGES)
def test_every_field_counts(field: str) -> None:
    d = decision()
    assert digest(d) != digest(msgspec.structs.replace(d, **{field: CHANGES[field]}))


def test_the_last_bit_of_a_probability_counts() -> None:
    d = decision()
    risk = msgspec.structs.replace(d.risk, probability=math.nextafter(d.risk.probability, 1.0))
    assert digest(d) != digest(msgspec.structs.replace(d, risk=risk))


def test_order_and_number_of_ticks_count() -> None:
    a, b = play(stage(SPEC), 2)
    assert len({digest(), digest(a), digest(a, b), digest(b, a), digest(a, a)}) == 5


def test_equal_decisions_have_equal_digests() -> None:
    assert digest(decision()) == digest(decision())


def test_the_memory_journal_keeps_what_came_in_and_what_was_decided() -> None:
    supervisor, journal = stage(SPEC), MemoryJournal()
    samples = [fresh(10 * MS)]
    d = supervisor.step(samples, 10 * MS)
    journal.tick(samples, d)
    samples.clear()
    assert journal.ticks == [((fresh(10 * MS),), d)]
    assert journal.verdicts == [{}]
    reset = OperatorReset(10 * MS, "operator 7", "looked at the robot")
    journal.operator_reset(reset)
    journal.tick((), d, {"d": "late"})
    assert journal.verdicts == [{}, {"d": "late"}]
    assert journal.resets == [(1, reset)]


def test_records_are_frozen_and_compare_by_value() -> None:
    one = Indication(SLIP, "", 1, True, 1.0, 0.5, "1", evidence=(SampleRef("c", 1),))
    assert one == Indication(SLIP, "", 1, True, 1.0, 0.5, "1", evidence=(SampleRef("c", 1),))
    with pytest.raises(AttributeError):
        one.present = False  # type: ignore[misc]  # what is tested


def test_a_decision_survives_the_wire_exactly() -> None:
    d = decision()
    assert msgspec.msgpack.decode(msgspec.msgpack.encode(d), type=Decision) == d


def test_verdicts_and_resets_count_with_their_place_and_content() -> None:
    d = decision()
    resets = [
        OperatorReset(1, "a", "b"),
        OperatorReset(2, "a", "b"),
        OperatorReset(1, "b", "b"),
        OperatorReset(1, "a", ""),
    ]

    def of(*entries: object) -> str:
        journal = DigestJournal()
        for entry in entries:
            if isinstance(entry, OperatorReset):
                journal.operator_reset(entry)
            else:
                journal.tick((), d, entry)  # type: ignore[arg-type]  # verdicts
        return journal.digest

    late, hung = {"d": "late"}, {"d": "hung"}
    histories = [
        ({}, {}),
        (late, {}),
        ({}, late),
        (hung, {}),
        ({"e": "late"}, {}),
        (resets[0], {}, {}),
        ({}, resets[0], {}),
    ]
    histories += [({}, r, {}) for r in resets[1:]]
    assert len({of(*h) for h in histories}) == len(histories)
    assert of({}, {}) == digest(d, d)  # a run without verdicts and resets is its decisions
    assert of({"a": "x", "b": "y"}) == of({"b": "y", "a": "x"})
