"""A detector in a child process may segfault or hang: the supervisor runs on, and says what happened."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace

import foreshock_cells as cells
import msgspec
import pytest
from foreshock_stage import MS, SLIP, TORSO, detector, fresh, health_of, module, said

from foreshock import isolation
from foreshock.config import Config, DetectorEntry, PolicyEntry
from foreshock.detector import Inputs
from foreshock.errors import MissingExtraError, PluginError
from foreshock.journal import DigestJournal, MemoryJournal
from foreshock.messages import Scalar
from foreshock.records import Decision, Indication, ProtectionLevel
from foreshock.registry import Registry
from foreshock.supervisor import Supervisor

TICK = 20 * MS


def supervise(**config: object) -> Supervisor:
    other = detector("other", [TORSO], lambda now: [said(TORSO, False, now)])
    entries = (DetectorEntry("cell", config=dict(config)), DetectorEntry("other"))
    modules = {"cell": cells, "other": module([other])}
    return Supervisor(Config(entries, policies=(PolicyEntry("paper-gate"),)), registry=Registry(modules=modules))


@pytest.fixture(autouse=True)
def patience(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """However busy this machine is, only a child that hangs counts as hung."""
    hang_s = 1.5 if "[hang]" in request.node.name or "a_hang_is" in request.node.name else 20.0
    monkeypatch.setattr(isolation.ChildDetector.__init__, "__defaults__", (hang_s,))


@pytest.fixture
def supervisor(patience: None) -> Iterator[Supervisor]:
    """One with a child and a detector in process."""
    s = supervise()
    yield s
    s.close()


class Bench:
    """Steps a supervisor, one value a tick."""

    def __init__(self, supervisor: Supervisor) -> None:
        self.supervisor, self.k = supervisor, 0

    def tick(self, what: float) -> Decision:
        self.k += 1
        return self.supervisor.step([fresh(self.k * TICK, value=what)], self.k * TICK)


def pid_of(d: Decision) -> int:
    (i,) = [i for i in d.indications if i.kind == SLIP]
    return int(i.measures["pid"])


def is_gone(pid: int) -> bool:
    """No such process, not even as a zombie: it was killed and collected."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    return False


CRASHES = {
    "segfault": (cells.SEGFAULT, "SIGSEGV"),
    "abort": (cells.ABORT, "SIGABRT"),
    "hang": (cells.HANG, "hung"),
    "exit": (cells.EXIT, "exit code 7"),
}


@pytest.mark.parametrize("name", CRASHES)
def test_a_crash_or_hang_stays_in_the_child(supervisor: Supervisor, name: str) -> None:
    what, named = CRASHES[name]
    bench = Bench(supervisor)
    good = bench.tick(cells.PRESENT)
    first = pid_of(good)
    assert first != os.getpid()
    assert not is_gone(first)
    bad = bench.tick(what)
    assert bad.trust.unobserved == (SLIP,)
    assert bad.risk.probability == good.risk.probability
    (state, reason) = health_of([bad], "cell")[0]
    assert state == "failed"
    assert named in reason
    assert is_gone(first)
    # recovery: a new child, reset with the seed, sees absence, and the evidence runs on
    back = bench.tick(cells.ABSENT)
    assert back.trust.unobserved == ()
    assert pid_of(back) not in (first, os.getpid())
    assert back.precursors[0].phase == "cleared"
    second = pid_of(back)
    supervisor.close()
    assert is_gone(second)


def test_an_error_in_the_child_is_named_and_costs_no_child(supervisor: Supervisor) -> None:
    bench = Bench(supervisor)
    first = pid_of(bench.tick(cells.ABSENT))
    bad = bench.tick(cells.RAISE)
    assert health_of([bad], "cell") == [("failed", "verdict: ValueError: in the cell")]
    assert pid_of(bench.tick(cells.ABSENT)) == first


@pytest.mark.parametrize("what", [cells.GARBAGE, cells.STRING])
def test_garbage_from_the_child_is_contained(supervisor: Supervisor, what: float) -> None:
    bench = Bench(supervisor)
    bench.tick(cells.ABSENT)
    bad = bench.tick(what)
    assert bad.trust.unobserved == (SLIP,)
    assert bench.tick(cells.ABSENT).trust.unobserved == ()


def test_numpy_s_floats_and_chatter_pass_as_they_do_in_process(supervisor: Supervisor) -> None:
    bench = Bench(supervisor)
    d = bench.tick(cells.NUMPY)
    assert d.trust.unobserved == ()
    DigestJournal().tick((), d)
    assert bench.tick(cells.FLOOD).trust.unobserved == ()


def test_three_crashes_give_up_until_reset_and_minimal_risk_follows(supervisor: Supervisor) -> None:
    bench = Bench(supervisor)
    bench.tick(cells.ABSENT)
    for _ in range(3):
        d = bench.tick(cells.EXIT)
    assert "gave up after 3 failures" in health_of([d], "cell")[0][1]
    for _ in range(20):
        d = bench.tick(cells.ABSENT)
    assert d.level is ProtectionLevel.MINIMAL_RISK
    supervisor.reset(5, bench.k * TICK)
    d = bench.tick(cells.ABSENT)
    assert d.trust.unobserved == ()
    assert {i.measures["seed"] for i in d.indications if i.kind == SLIP} == {5.0}


def test_in_process_and_child_give_the_same_decisions() -> None:
    def digest(where: str) -> str:
        entry = DetectorEntry("cell", isolation=where)
        config = Config((entry,), policies=(PolicyEntry("paper-gate"),))
        supervisor, journal = Supervisor(config, registry=Registry(modules={"cell": cells})), DigestJournal()
        try:
            for k, what in enumerate([0, 1, 1, 4, 0, 1, 0, 0, 1, 7, 0], start=1):
                d = supervisor.step([fresh(k * TICK, value=float(what))], k * TICK)
                # the process and the name of the exception class are the only things that may differ
                plain = tuple(msgspec.structs.replace(i, measures={}) for i in d.indications)
                journal.tick((), msgspec.structs.replace(d, indications=plain, health=()))
        finally:
            supervisor.close()
        return journal.digest

    assert digest("process") == digest("in-process")


def test_a_child_that_cannot_be_built_is_one_clear_error() -> None:
    with pytest.raises(PluginError, match=r"detectors\[0\].*'cell' cannot be built: ZeroDivisionError: broken"):
        supervise(broken=True)


def test_a_child_without_its_package_says_what_to_install() -> None:
    spec = msgspec.structs.replace(cells.CELL, build=cells.build_elsewhere)
    registry = Registry(modules={"cell": module([spec])})
    with pytest.raises(MissingExtraError, match=r"pip install 'foreshock\[balance\]'"):
        Supervisor(Config((DetectorEntry("cell"),), policies=(PolicyEntry("paper-gate"),)), registry=registry)


def test_a_build_that_cannot_be_sent_to_a_child_is_one_clear_error() -> None:
    spec = msgspec.structs.replace(cells.CELL, build=lambda config: cells.Cell())
    registry = Registry(modules={"cell": SimpleNamespace(foreshock_detectors=module([spec]).foreshock_detectors)})
    with pytest.raises(PluginError, match=r"'cell' cannot be built: .*child process"):
        Supervisor(Config((DetectorEntry("cell"),), policies=(PolicyEntry("paper-gate"),)), registry=registry)


def test_close_is_idempotent_and_leaves_no_process(tmp_path: Path) -> None:
    supervisor = supervise()
    pid = pid_of(Bench(supervisor).tick(cells.ABSENT))
    supervisor.close()
    supervisor.close()
    assert is_gone(pid)


class Stub(cells.Cell):
    """The same measurements as the cell's, in this process; it neither hangs nor raises nor dies."""

    def __init__(self, pids: dict[int, float]) -> None:
        self._pids = pids

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:
        sample = inputs.latest["value"]
        calm = msgspec.structs.replace(sample, value=Scalar(min(sample.value.data, cells.PRESENT)))
        (i,) = super().update(now_ns, Inputs({"value": calm}, inputs.new))
        return [msgspec.structs.replace(i, measures={**i.measures, "pid": self._pids.get(now_ns, 0.0)})]


def replay(journal: MemoryJournal) -> str:
    """Digest of the run again, with the recorded verdicts and the stub in the child's place."""
    pids = {d.now_ns: i.measures["pid"] for _, d in journal.ticks for i in d.indications if i.kind == SLIP}
    spec = msgspec.structs.replace(cells.CELL, build=lambda config: Stub(pids), isolation="in-process")
    again, other = Supervisor(CELL_ALONE, registry=Registry(modules={"cell": module([spec])})), DigestJournal()
    for (samples, old), verdicts in zip(journal.ticks, journal.verdicts, strict=True):
        d = again.step(samples, old.now_ns, verdicts)
        assert d == old
        other.tick(samples, d, again.verdicts_of(d))
    return other.digest


CELL_ALONE = Config((DetectorEntry("cell"),), policies=(PolicyEntry("paper-gate"),))


def record(
    values: Sequence[float], at: Callable[[int, Supervisor], object] = lambda k, s: None
) -> tuple[MemoryJournal, str]:
    """A run with the real child, by tick; what it recorded and its digest."""
    live = Supervisor(CELL_ALONE, registry=Registry(modules={"cell": cells}))
    kept, digests = MemoryJournal(), DigestJournal()
    try:
        for k, what in enumerate(values, start=1):
            at(k, live)
            samples = [fresh(k * TICK, value=float(what))]
            d = live.step(samples, k * TICK)
            for journal in (kept, digests):
                journal.tick(samples, d, live.verdicts_of(d))
    finally:
        live.close()
    return kept, digests.digest


def test_a_hang_is_recorded_as_a_verdict_and_replays_without_the_child() -> None:
    kept, digest = record([cells.ABSENT, cells.PRESENT, cells.HANG, cells.ABSENT, cells.PRESENT, cells.ABSENT])
    hung = {"cell": "child process of cell hung for 1.5 s"}
    assert kept.verdicts == [{}, {}, hung, {}, {}, {}]
    assert kept.ticks[2][1].trust.unobserved == (SLIP,)
    assert replay(kept) == digest


def test_whatever_befalls_a_child_replays_without_it_until_it_is_given_up() -> None:
    """Twice the same death in a row, garbage, and three failures that end it: each is told in its tick."""
    for values in (
        [0, 1, cells.EXIT, cells.EXIT, 0, 1],
        [0, cells.RAISE, 1, cells.GARBAGE, 0],
        [1, cells.RAISE, cells.RAISE, cells.RAISE, 0, 0],
    ):
        kept, digest = record(values)
        failed = [k for k, what in enumerate(values) if what in (cells.EXIT, cells.RAISE, cells.GARBAGE)]
        assert [k for k, v in enumerate(kept.verdicts) if v] == failed
        assert replay(kept) == digest


def test_a_child_that_cannot_be_restarted_replays_as_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(self: object) -> None:
        raise isolation.ChildError("cannot be started in a child process: OSError: no more processes")

    kept, digest = record(
        [0, 1, cells.EXIT, 1, 0],
        lambda k, s: monkeypatch.setattr(isolation.ChildDetector, "_start", broken) if k == 3 else None,
    )
    assert [bool(v) for v in kept.verdicts] == [False, False, True, False, False]
    assert kept.verdicts[2]["cell"].startswith("gave up: reset raised cannot be started")
    assert "exit code 7" in kept.verdicts[2]["cell"]
    assert all(d.trust.unobserved == (SLIP,) for _, d in kept.ticks[2:])
    assert replay(kept) == digest
