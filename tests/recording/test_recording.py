"""Journals in files: exact replay, what was altered, what was torn, what would have happened, and a killed writer."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from foreshock.cli import main
from foreshock.config import parse_config
from foreshock.errors import BadInputError
from foreshock.journal import MemoryJournal
from foreshock.messages import Scalar
from foreshock.recording import (
    DECISION,
    END,
    RESET,
    TICK,
    Head,
    JournalFile,
    McapJournal,
    Records,
    recover,
    summary,
)
from foreshock.records import Sample
from foreshock.registry import Registry
from foreshock.session.replay import replay
from foreshock.supervisor import Supervisor

CONFIG = {
    "supervisor": {"robot": "robot", "period_s": 0.01},
    "detectors": [{"use": "telemetry"}],
    "gates": {"latch": "protective"},
    "policies": [],
}
TICK_NS = 10_000_000


def recorded(path: Path, ticks: int = 120, broken: int = 60) -> str:
    """A run on a Scalar stream that ends after some ticks, with an operator's reset; the digest."""
    supervisor = Supervisor(parse_config(CONFIG, "config"))
    journal = McapJournal(path, Head(CONFIG, "", 0, 0))
    supervisor.reset(0)
    for k in range(1, ticks + 1):
        now_ns = k * TICK_NS
        value = float("nan") if k == 20 else 0.1 * k
        samples = [] if k >= broken else [Sample(now_ns - 1000, "robot/a/b", Scalar(value), k, now_ns)]
        if k == ticks - 10:
            journal.operator_reset(supervisor.operator_reset("jane", "looked at it", now_ns))
        decision = supervisor.step(samples, now_ns)
        journal.tick(samples, decision, supervisor.verdicts_of(decision))
    journal.close()
    supervisor.close()
    return journal.digest


def test_a_replay_makes_the_same_decisions(tmp_path: Path) -> None:
    digest = recorded(tmp_path / "a.mcap")
    memory = MemoryJournal()
    result = replay(tmp_path / "a.mcap", journals=[memory])
    assert result.agrees
    assert result.complete
    assert (result.ticks, result.recorded, result.replayed) == (120, digest, digest)
    assert [r.who for _, r in memory.resets] == ["jane"]
    samples = [s for given_, _ in memory.ticks for s in given_]
    assert len(samples) == 59
    assert (samples[0].stamp_ns, samples[0].seq, samples[0].received_ns) == (TICK_NS - 1000, 1, TICK_NS)


def test_foxglove_and_rosbags_read_it(tmp_path: Path) -> None:
    """By the reference reader of MCAP and by rosbags, with nothing of ours."""
    from mcap.reader import make_reader
    from rosbags.typesys import Stores, get_typestore

    recorded(tmp_path / "a.mcap")
    store = get_typestore(Stores.ROS2_JAZZY)
    with (tmp_path / "a.mcap").open("rb") as file:
        found = list(make_reader(file, validate_crcs=True).iter_messages(["/robot/a/b"]))
    assert len(found) == 59
    schema, channel, message = found[4]
    assert (schema.name, schema.encoding, channel.message_encoding) == ("std_msgs/msg/Float64", "ros2msg", "cdr")
    assert store.deserialize_cdr(message.data, schema.name).data == 0.5


def test_a_journal_is_never_overwritten(tmp_path: Path) -> None:
    recorded(tmp_path / "a.mcap")
    with pytest.raises(BadInputError, match="never overwritten"):
        recorded(tmp_path / "a.mcap")


def rewritten(path: Path, out: Path, change: Callable[[str, Any], bytes | None]) -> None:
    """The same file, closed, all checksums of MCAP right, with what change makes of each message; None: left out."""
    from mcap.reader import make_reader
    from mcap.writer import Writer

    with path.open("rb") as source, out.open("wb") as target:
        writer = Writer(target)
        writer.start()
        for record in Records(path):
            if type(record).__name__ == "Metadata":
                writer.add_metadata(record.name, record.metadata)
        schemas: dict[int, int] = {}
        channels: dict[int, int] = {}
        for schema, channel, message in make_reader(source).iter_messages(log_time_order=False):
            if schema.id not in schemas:
                schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
            if channel.id not in channels:
                encoding = channel.message_encoding
                channels[channel.id] = writer.register_channel(channel.topic, encoding, schemas[schema.id])
            data = change(channel.topic, message)
            if data is not None:
                writer.add_message(channels[channel.id], message.log_time, data, message.publish_time, message.sequence)
        writer.finish()


def altered(path: Path, out: Path) -> None:
    """The same file with the last bit of each sample after 0.3 s changed."""

    def flip(topic: str, message: Any) -> bytes:
        data = message.data
        return data[:-1] + bytes([data[-1] ^ 1]) if topic == "/robot/a/b" and message.log_time > 300_000_000 else data

    rewritten(path, out, flip)


def test_an_altered_sample_is_found_though_no_decision_depends_on_it(tmp_path: Path) -> None:
    recorded(tmp_path / "a.mcap")
    altered(tmp_path / "a.mcap", tmp_path / "b.mcap")
    result = replay(tmp_path / "b.mcap")
    assert result.altered_at is not None
    assert not result.agrees


def _cut(topic: str, message: Any) -> bytes | None:
    return message.data if message.log_time <= 70 * TICK_NS else None


ALTERATIONS: dict[str, tuple[Callable[[str, Any], bytes | None], int, str]] = {
    "a decision says otherwise": (
        lambda topic, m: (
            m.data.replace(b'"trust":1.0', b'"trust":0.1') if topic == DECISION and m.sequence >= 40 else m.data
        ),
        40,
        "not the one that was recorded",
    ),
    "no decisions": (lambda topic, m: None if topic == DECISION else m.data, 0, "0 decisions instead of one"),
    "one decision less": (
        lambda topic, m: None if topic == DECISION and m.sequence == 33 else m.data,
        33,
        "0 decisions instead of one",
    ),
    "the end cut off": (lambda topic, m: m.data if topic == END else _cut(topic, m), 70, "70 ticks, and 120"),
    "the end cut off, and the end record": (_cut, 70, "its end record is missing"),
    "a tick cut off that leaves its decision": (
        lambda topic, m: None if topic in (TICK, END) and m.log_time == 120 * TICK_NS else m.data,
        119,
        "its end record is missing",
    ),
}


@pytest.mark.parametrize(("change", "tick", "said"), ALTERATIONS.values(), ids=ALTERATIONS)
def test_what_an_investigator_reads_is_what_was_decided(
    tmp_path: Path, change: Callable[[str, Any], bytes | None], tick: int, said: str
) -> None:
    recorded(tmp_path / "a.mcap")
    rewritten(tmp_path / "a.mcap", tmp_path / "same.mcap", lambda _, m: m.data)
    assert replay(tmp_path / "same.mcap").agrees
    rewritten(tmp_path / "a.mcap", tmp_path / "b.mcap", change)
    result = replay(tmp_path / "b.mcap")
    assert (result.altered_at, result.differs_at) == (tick, None)
    assert said in result.altered
    assert not result.agrees


@pytest.mark.parametrize("what", ["log_time", "publish_time"])
def test_messages_moved_in_time_are_found(tmp_path: Path, what: str) -> None:
    recorded(tmp_path / "a.mcap")

    def later(topic: str, message: Any) -> bytes:
        if topic == DECISION and message.sequence == 50:
            setattr(message, what, getattr(message, what) + 1)
        return bytes(message.data)

    rewritten(tmp_path / "a.mcap", tmp_path / "b.mcap", later)
    assert replay(tmp_path / "b.mcap").altered_at == 50


def test_a_reset_after_the_last_tick_is_protected_too(tmp_path: Path) -> None:
    supervisor = Supervisor(parse_config(CONFIG, "config"))
    journal = McapJournal(tmp_path / "a.mcap", Head(CONFIG, "", 0, 0))
    supervisor.reset(0)
    journal.tick([], supervisor.step([], TICK_NS))
    journal.operator_reset(supervisor.operator_reset("jane", "looked at it", TICK_NS))
    journal.close()
    supervisor.close()
    assert replay(tmp_path / "a.mcap").agrees
    rewritten(
        tmp_path / "a.mcap",
        tmp_path / "b.mcap",
        lambda t, m: m.data.replace(b"jane", b"jack") if t == RESET else m.data,
    )
    assert replay(tmp_path / "b.mcap").altered == "the decisions are not those of the end record"
    recover(tmp_path / "a.mcap", tmp_path / "c.mcap")
    assert replay(tmp_path / "c.mcap").agrees


def test_an_older_file_has_no_end_record_and_says_so(tmp_path: Path) -> None:
    supervisor = Supervisor(parse_config(CONFIG, "config"))
    journal = McapJournal(tmp_path / "new.mcap", Head(CONFIG, "", 0, 0, version=1))
    supervisor.reset(0)
    for k in range(1, 20):
        journal.tick([], supervisor.step([], k * TICK_NS))
    journal.close()
    supervisor.close()
    rewritten(tmp_path / "new.mcap", tmp_path / "old.mcap", lambda topic, m: None if topic == END else m.data)
    result = replay(tmp_path / "old.mcap")
    assert result.agrees
    assert result.complete
    assert result.warning.startswith("no end record")


@given(st.data())
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_flipped_byte_is_damage_an_alteration_or_nothing_that_matters(tmp_path: Path, data: st.DataObject) -> None:
    path = tmp_path / "a.mcap"
    if not path.exists():
        recorded(path)
    content = bytearray(path.read_bytes())
    content[data.draw(st.integers(0, len(content) - 1))] ^= data.draw(st.integers(1, 255))
    (tmp_path / "flipped.mcap").write_bytes(content)
    out = tmp_path / "whole.mcap"
    out.unlink(missing_ok=True)
    with contextlib.suppress(BadInputError):
        result = recover(tmp_path / "flipped.mcap", out)
        assert result.ticks <= 120
        assert replay(out).agrees or replay(tmp_path / "flipped.mcap").altered_at is not None
    with contextlib.suppress(BadInputError):
        result = replay(tmp_path / "flipped.mcap")
        whole = replay(path)
        # what replays without complaint is a beginning of what was recorded
        assert result.ticks <= whole.ticks


@given(st.integers(1, 10_000))
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_torn_file_replays_up_to_where_it_is_torn(tmp_path: Path, cut: int) -> None:
    path = tmp_path / "a.mcap"
    if not path.exists():
        recorded(path)
    content = path.read_bytes()
    torn = tmp_path / "torn.mcap"
    torn.write_bytes(content[: max(1, len(content) * cut // 10_000)])
    try:
        result = replay(torn)
    except BadInputError:
        assert cut < 5000, "the head comes first"
        return
    assert result.agrees
    whole = tmp_path / "whole.mcap"
    whole.unlink(missing_ok=True)
    assert recover(torn, whole).ticks == result.ticks
    again = replay(whole)
    assert (again.ticks, again.replayed, again.complete) == (result.ticks, result.replayed, True)


def test_what_an_operator_did_after_the_last_tick_is_recovered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("foreshock.recording._write.CHUNK_BYTES", 1)  # so that every message is in the file at once
    supervisor = Supervisor(parse_config(CONFIG, "config"))
    journal = McapJournal(tmp_path / "a.mcap", Head(CONFIG, "", 0, 0))
    supervisor.reset(0)
    for k in range(1, 4):
        decision = supervisor.step([], k * TICK_NS)
        journal.tick([], decision, supervisor.verdicts_of(decision))
    journal.operator_reset(supervisor.operator_reset("jane", "looked at it", 4 * TICK_NS))
    journal._file.flush()
    torn, whole = tmp_path / "torn.mcap", tmp_path / "whole.mcap"
    torn.write_bytes((tmp_path / "a.mcap").read_bytes())
    journal.close()
    supervisor.close()
    recover(torn, whole)
    memory = MemoryJournal()
    found = [replay(path, journals=[memory]) for path in (torn, whole, tmp_path / "a.mcap")]
    assert len({(f.ticks, f.replayed, f.agrees) for f in found}) == 1
    assert found[1].agrees
    assert found[1].complete


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "torn, then zeros, as after a power cut": lambda content: content[: len(content) * 2 // 3] + bytes(8192),
    "a flipped byte in its middle": lambda content: flipped(content, boundary(content) + 500),
    "a chunk that no reader knows": lambda content: flipped(content, boundary(content), 0x40),
}


def flipped(content: bytes, at: int, by: int = 1) -> bytes:
    return content[:at] + bytes([content[at] ^ by]) + content[at + 1 :]


def boundary(content: bytes) -> int:
    """Where the third chunk begins, by the framing of MCAP: opcode, length, content."""
    at, chunks = 8, 0
    while True:
        chunks += content[at] == 6
        if chunks == 3:
            return at
        at += 9 + int.from_bytes(content[at + 1 : at + 9], "little")


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_damaged_file_is_saved_up_to_the_damage(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], damage: Callable[[bytes], bytes]
) -> None:
    path, out = tmp_path / "a.mcap", tmp_path / "whole.mcap"
    recorded(path, 600, 500)
    whole = path.read_bytes()
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(damage(whole))
    for words in (["replay"], ["journal", "info"]):
        with pytest.raises(SystemExit) as end:
            main([*words, str(broken)])
        said = capsys.readouterr()
        if words == ["replay"] and "altered, at tick" in said.out:
            assert end.value.code == 1, "ticks that are missing between others, with no other sign of damage"
            continue
        assert end.value.code == 2
        assert f"foreshock journal recover {broken} OUT" in " ".join(said.err.split())
    found = recover(broken, out)
    assert 0 < found.ticks < 600
    assert not found.complete
    told = re.search(r"; (\d+) of its (\d+) bytes, from byte (\d+) on, are left out", found.left_out)
    assert told is not None
    rest, size, at = map(int, told.groups())
    assert size == rest + at == broken.stat().st_size
    result = replay(out)
    assert (result.ticks, result.complete, result.agrees) == (found.ticks, True, True)
    assert found.left_out in result.warning
    assert summary(out).left_out == found.left_out
    # what is left out is less than a chunk before the damage
    first = next(k for k, (x, y) in enumerate(zip(whole, broken.read_bytes(), strict=False)) if x != y)
    assert first - 16_384 <= at <= first
    assert recover(out, tmp_path / "again.mcap").left_out == found.left_out


def test_a_file_that_cannot_be_recovered_leaves_nothing_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, out = tmp_path / "a.mcap", tmp_path / "whole.mcap"
    recorded(path)

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr("mcap.writer.Writer.finish", full)
        with pytest.raises(BadInputError, match="cannot be written: No space left on device"):
            recover(path, out)
    assert not out.exists()
    recover(path, out)
    content = out.read_bytes()
    with pytest.raises(BadInputError, match="exists; nothing is overwritten"):
        recover(path, out)
    assert out.read_bytes() == content


def test_another_configuration_says_what_would_have_happened(tmp_path: Path) -> None:
    recorded(tmp_path / "a.mcap")
    other = parse_config({**CONFIG, "detectors": [{"use": "grip"}]}, "other")  # whose channel is not there at all
    result = replay(tmp_path / "a.mcap", config=other)
    assert result.foreign
    assert result.differs_at is not None
    assert "minimal-risk" in result.levels
    assert "minimal-risk" not in replay(tmp_path / "a.mcap").levels


def test_the_commands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    digest = recorded(tmp_path / "a.mcap")
    altered(tmp_path / "a.mcap", tmp_path / "b.mcap")

    def run(*words: object) -> tuple[int, dict]:
        with pytest.raises(SystemExit) as end:
            main([str(w) for w in (*words, "--json")])
        return int(end.value.code or 0), msgspec.json.decode(capsys.readouterr().out)

    code, result = run("replay", tmp_path / "a.mcap")
    assert (code, result["result"]["replayed"]) == (0, digest)
    assert run("replay", tmp_path / "b.mcap")[0] == 1
    code, result = run("journal", "info", tmp_path / "a.mcap")
    assert (code, result["result"]["ticks"], result["result"]["digest"]) == (0, 120, digest)
    assert run("journal", "recover", tmp_path / "a.mcap", tmp_path / "b.mcap")[0] == 2
    (tmp_path / "no.mcap").write_text("nothing of the kind")
    code, result = run("replay", tmp_path / "no.mcap")
    assert code == 2
    assert "no MCAP file" in result["errors"][0]["message"]


WRITER = """
import sys, time
from pathlib import Path
from foreshock.config import parse_config
from foreshock.messages import JointState
from foreshock.recording import Head, McapJournal
from foreshock.records import Sample
from foreshock.supervisor import Supervisor
config = {config!r}
supervisor = Supervisor(parse_config(config, "config"))
journal = McapJournal(Path(sys.argv[1]), Head(config, "", 0, 0))
names = tuple(f"joint-{{k}}" for k in range(32))
began = time.monotonic()
for k in range(1, 100_000):
    now_ns = k * 1_000_000
    samples = [Sample(now_ns, "robot/joints/state", JointState(names, (0.001 * k,) * 32), k, now_ns)]
    decision = supervisor.step(samples, now_ns)
    journal.tick(samples, decision, supervisor.verdicts_of(decision))
    if k % 50 == 0:
        print(k, flush=True)
    time.sleep(max(0.0, began + k * 0.001 - time.monotonic()))
"""


@pytest.mark.parametrize("after", range(60, 460, 20) if os.environ.get("FORESHOCK_SOAK") else [100, 250, 400])
def test_a_killed_writer_leaves_a_file_that_replays(tmp_path: Path, after: int) -> None:
    """At 1 kHz: what was flushed is there after SIGKILL; the last chunk, of 16 kB, is not: 1 tick is 1 kB or more."""
    path = tmp_path / "killed.mcap"
    config = {**CONFIG, "supervisor": {"robot": "robot", "period_s": 0.001}}
    process = subprocess.Popen(
        [sys.executable, "-c", WRITER.format(config=config), str(path)], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    told = 0
    try:
        for line in process.stdout:
            told = int(line)
            if told >= after:
                break
    finally:
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        process.stdout.close()
    size = path.stat().st_size
    time.sleep(0.05)
    assert path.stat().st_size == size
    result = replay(path)
    assert result.agrees
    assert not result.complete
    assert result.ticks >= told - 17
    whole = tmp_path / "whole.mcap"
    assert recover(path, whole).ticks == result.ticks
    again = replay(whole)
    assert again.agrees
    assert again.complete
    assert (again.ticks, again.replayed) == (result.ticks, result.replayed)
    assert summary(path).messages["/robot/joints/state"] == result.ticks


def test_the_head_names_what_wrote_it(tmp_path: Path) -> None:
    recorded(tmp_path / "a.mcap")
    head = JournalFile(tmp_path / "a.mcap").head
    assert head.config == CONFIG
    assert head.foreshock
    assert head.python.startswith(f"{sys.version_info.major}.{sys.version_info.minor}")
    assert Registry().names
