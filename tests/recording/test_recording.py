"""Journals in files: exact replay, what was altered, what was torn, what would have happened, and a killed writer."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from foreshock.cli import main
from foreshock.config import parse_config
from foreshock.errors import BadInputError
from foreshock.journal import MemoryJournal
from foreshock.messages import Scalar
from foreshock.recording import Head, JournalFile, McapJournal, recover, summary
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


def altered(path: Path, out: Path) -> None:
    """The same file with one sample's value changed, all checksums of MCAP right."""
    from mcap.reader import make_reader
    from mcap.writer import Writer

    from foreshock.recording import records_of

    with path.open("rb") as source, out.open("wb") as target:
        writer = Writer(target)
        writer.start()
        for record in records_of(path):
            if type(record).__name__ == "Metadata":
                writer.add_metadata(record.name, record.metadata)
        schemas: dict[int, int] = {}
        channels: dict[int, int] = {}
        for k, (schema, channel, message) in enumerate(make_reader(source).iter_messages(log_time_order=False)):
            if schema.id not in schemas:
                schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
            if channel.id not in channels:
                encoding = channel.message_encoding
                channels[channel.id] = writer.register_channel(channel.topic, encoding, schemas[schema.id])
            data = message.data
            if k >= 30 and channel.topic == "/robot/a/b":
                data = data[:-1] + bytes([data[-1] ^ 1])
            writer.add_message(channels[channel.id], message.log_time, data, message.publish_time, message.sequence)
        writer.finish()


def test_an_altered_sample_is_found_though_no_decision_depends_on_it(tmp_path: Path) -> None:
    recorded(tmp_path / "a.mcap")
    altered(tmp_path / "a.mcap", tmp_path / "b.mcap")
    result = replay(tmp_path / "b.mcap")
    assert result.altered_at is not None
    assert not result.agrees


@given(st.data())
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_flipped_byte_is_damage_an_alteration_or_nothing_that_matters(tmp_path: Path, data: st.DataObject) -> None:
    path = tmp_path / "a.mcap"
    if not path.exists():
        recorded(path)
    content = bytearray(path.read_bytes())
    content[data.draw(st.integers(0, len(content) - 1))] ^= data.draw(st.integers(1, 255))
    (tmp_path / "flipped.mcap").write_bytes(content)
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
    assert summary(path).messages["/robot/joints/state"] == result.ticks


def test_the_head_names_what_wrote_it(tmp_path: Path) -> None:
    recorded(tmp_path / "a.mcap")
    head = JournalFile(tmp_path / "a.mcap").head
    assert head.config == CONFIG
    assert head.foreshock
    assert head.python.startswith(f"{sys.version_info.major}.{sys.version_info.minor}")
    assert Registry().names
